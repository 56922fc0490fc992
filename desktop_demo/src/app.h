// What the demo shows and does: it brings the window, the threads and the painter together.
#pragma once

#include <array>
#include <deque>
#include <app/fly_camera.hpp>
#include <app/live_scene.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "file_thread.h"
#include "mapped_frame.h"
#include "painter.h"
#include "window.h"

constexpr char kFirstCamera[] = "camera:";

enum class Compare { kNone, kSlider, kError };

struct Options {
  std::string source = kFirstCamera;  // or a file, a folder with a capture
  View view = View::kParts;
  bool mesh = true, panel = true;
  std::string texture, capture, scene_bundle;
  Compare compare = Compare::kNone;
  std::string bundle;
  maq_densepose_config model = maquette::default_densepose_config();
  int width_px = 1280, height_px = 800;
  bool headless = false;
  uint64_t frames = 0;  // 0: until the window is closed
  std::string screenshot, out;
};

class App {
 public:
  explicit App(const Options& options);
  // Returns the exit code.
  int run();

 private:
  struct Stages {
    std::array<float, 8> ms{};
  };

  void open(const std::string& path_or_uri);
  void open_people();
  void load_outfit(const std::string& path);
  // One turn:
  void take_news();
  void take_keys();
  void steer(float seconds);
  void draw();

  void fly(float look_right, float look_down, float seconds);
  float slider_x() const;
  void set_compare(Compare compare);
  void set_scene_pictures();
  void go_to_photo(int index);
  void draw_boxes(const MappedFrame& frame);
  void draw_slider();
  void draw_news();
  void draw_panel(int width_px);
  void draw_people_panel();
  void draw_scene_panel();
  void draw_stages(const char* const* names, size_t count);
  void draw_help();

  std::string new_path(const char* extension);
  void take_snapshot();
  void toggle_clip();
  void add_to_clip();
  void toggle_recording();

  bool has_failed() const;
  bool is_done();
  std::string report() const;

  Options options_;
  double start_s_;
  maquette::Context context_;
  Window window_;
  Painter painter_;
  maquette::Newest<MappedFrame> mapped_;
  std::vector<uint8_t> seen_;
  maquette::LiveDensePose people_;
  maquette::LiveScene scenes_;
  std::optional<maquette::FlyCamera> flight_;

  bool shows_scene_ = false, seeks_camera_ = false, paused_ = false, help_ = false;
  bool fresh_ = false;   // this turn has a new picture
  bool ended_ = false;   // the source, at this turn's frame
  bool moving_ = false;  // the flight
  bool has_surface_ = false;
  bool drags_slider_ = false;
  float slider_ = 0.5f, yaw_ = 0.5f, pitch_ = 0.15f;
  int photo_ = 0;        // where the flight was last or goes to
  bool turned_ = false;  // the flight, other than by the person
  Rect picture_area_{0, 0, 1, 1}, picture_rect_, looked_at_, body_rect_, clip_rect_;
  uint64_t pictures_ = 0, done_pictures_ = 0;  // of scenes
  std::deque<Stages> stages_;
  int files_made_ = 0;
  std::string told_, clip_path_, recording_;
  double told_at_s_ = -100, start_ms_ = 0, cpu_percent_ = 0, cpu_at_s_ = 0, cpu_s_ = 0, memory_mb_ = 0;
  std::vector<float> turns_ms_;
  std::shared_ptr<std::optional<maquette::Clip>> clip_file_;
  maquette::Newest<maquette::Picture> outfits_;
  FileThread files_;  // last: its jobs use the others
};
