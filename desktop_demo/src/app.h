// Brings window, views, panel and saver together: routes what the user does, and draws one frame after the other.
#pragma once

#include <app/triple_buffer.h>
#include <string>

#include "headless.h"
#include "options.h"
#include "painter.h"
#include "panel.h"
#include "people_view.h"
#include "saver.h"
#include "scene_view.h"
#include "window.h"

class App {
 public:
  explicit App(const Options& options);
  int run();  // returns the exit code

 private:
  void open(const std::string& path_or_uri);
  void show_people();
  void load_outfit(const std::string& path);
  void draw_frame(double seconds);
  void take_drops();
  void take_keys();
  void steer(float seconds);
  void draw();
  void draw_message(const Rect& area);
  void perform(Action action);
  Rect image_rect() const { return shows_scene_ ? scene_.image_rect() : people_.image_rect(); }

  const Options options_;
  HeadlessRun headless_;
  maquette::Context context_;
  Window window_;
  Painter painter_;
  Panel panel_;
  PeopleView people_;
  SceneView scene_;
  bool shows_scene_ = false, shows_panel_, shows_help_ = false;
  bool has_new_image_ = false;  // with this frame
  Rect area_{0, 0, 1, 1};       // of the window, beside the panel
  maquette::TripleBuffer<maquette::RgbaImage> outfits_;
  Saver saver_;  // last: its jobs use the others
};
