// Connects window, views, panel and saver: passes the user's actions on, and draws one frame after the other.
#pragma once

#include <app/saver.h>
#include <app/triple_buffer.h>
#include <algorithm>
#include <string>
#include <vector>

#include "edges_view.h"
#include "head_view.h"
#include "options.h"
#include "panel.h"
#include "people_view.h"
#include "prediction_view.h"
#include "scene_view.h"
#include "screen/painter.h"
#include "screen/window.h"

// How long a window's thread took for its frames, for the report of a run without a user.
class FrameTimes {
 public:
  // Times are in seconds of one clock.
  explicit FrameTimes(double now_s) : start_s_(now_s) {}

  // A frame that began at `begin_s` is on the screen now. The first counts from when this was made.
  void add(double begin_s, double now_s) {
    if (start_ms_ == 0) {
      start_ms_ = (now_s - start_s_) * 1000;
    } else if (ms_.size() < kMaxFrames) {
      ms_.push_back(float((now_s - begin_s) * 1000));
    }
  }

  double start_ms() const { return start_ms_; }  // to the first frame
  size_t count() const { return ms_.size(); }
  // 0 without any.
  double percentile_ms(size_t percent) const {
    std::vector<float> sorted = ms_;
    std::sort(sorted.begin(), sorted.end());
    return sorted.empty() ? 0 : double(sorted[(sorted.size() - 1) * percent / 100]);
  }

 private:
  static constexpr size_t kMaxFrames = 1000000;
  const double start_s_;
  double start_ms_ = 0;
  std::vector<float> ms_;
};

class App {
 public:
  explicit App(const Options& options);  // which must outlive this
  int run();                             // returns the exit code

 private:
  void draw_frame(double seconds);
  void take_drops();
  void take_keys();
  void steer(float seconds, const Rect& area);
  void draw_message(const Rect& area);
  void perform(Action action);
  void show(LiveView& view);  // in place of the one that is shown
  void open(const std::string& path_or_uri);
  void show_head(bool adds_photo);
  void load_outfit(const std::string& path);
  int report(const maquette::RgbaImage& screenshot);

  const Options& options_;
  FrameTimes times_{monotonic_s()};
  maquette::Context context_;
  Window window_;
  Painter painter_;
  Panel panel_;
  PeopleView people_;
  EdgesView edges_;
  PredictionView prediction_;
  SceneView scene_;
  HeadView head_;
  LiveView* live_ = &people_;  // or &edges_, &prediction_: shown, or behind the scene
  MainView* view_ = &people_;  // live_, &scene_ or &head_
  bool seeks_head_ = false;    // of the first image
  bool shows_panel_ = true, shows_help_ = false;
  maquette::TripleBuffer<maquette::RgbaImage> outfits_;
  maquette::Saver saver_;  // last: its jobs use the others
};
