// Connects window, views, panel and saver: passes the user's actions on, and draws one frame after the other.
#pragma once

#include <app/run_measurements.h>
#include <app/saver.h>
#include <app/triple_buffer.h>
#include <string>

#include "edges_view.h"
#include "head_view.h"
#include "options.h"
#include "panel.h"
#include "people_view.h"
#include "prediction_view.h"
#include "scene_view.h"
#include "screen/painter.h"
#include "screen/window.h"

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
  maquette::FrameTimes times_{monotonic_s()};
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
