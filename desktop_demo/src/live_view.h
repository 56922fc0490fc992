// Shared by views of a live source: opening, pausing and recording it, its messages and its report.
#pragma once

#include <app/live_pipeline.h>
#include <app/saver.h>
#include <string>

#include "main_view.h"

// The sources that a view opens by itself.
struct OwnSources {
  const char* start;     // when the user comes to the view and there is no source yet
  const char* camera;    // when they look for a camera
  const char* stand_in;  // where there is none
  const char* stand_in_text;
};

class LiveView : public MainView {
 public:
  LiveView(const Options& options, const Window& window, Painter& painter, const OwnSources& own)
      : MainView(options, window, painter), own_(own) {}

  void open(const std::string& uri);
  // Closes the source and returns its URI, so another view can open it; "" without a source.
  std::string hand_over();
  void open_first() { open(own_.start); }
  void open_camera() { open(own_.camera); }
  bool has_source() const { return !live_->status().uri.empty(); }
  virtual void set_visible(bool is_visible);      // it pauses while it is not
  void toggle_recording(maquette::Saver& saver);  // of the source, into the saver's folder

  Action press(int key) override;
  std::string message() const override;
  bool act_alone() override { return has_ended_; }
  std::string failure() const override;
  void add_to_report(nlohmann::ordered_json* report) const override;

 protected:
  // Sets the player of the view; it must outlive the view's calls.
  void set_live(maquette::LivePlayer* live) { live_ = live; }
  // To be asked before a frame is taken, which then is the last.
  void note_end() { has_ended_ = live_->status().has_ended; }
  Action draw_source(double results_per_second) const;  // in the panel
  void draw_pause();

 private:
  void apply_pause() { live_->set_paused(is_paused_ || !is_visible_); }

  const OwnSources own_;
  maquette::LivePlayer* live_ = nullptr;
  bool is_paused_ = false, is_visible_ = true, seeks_camera_ = false;
  bool has_ended_ = false;  // with the result of the latest update()
  std::string recording_;   // its path; "" without one
};
