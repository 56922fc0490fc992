// The content of the window next to the panel: people (PeopleView), edges (EdgesView), prediction (PredictionView), a
// scene (SceneView) or a head (HeadView).
#pragma once

#include <app/saver.h>
#include <nlohmann/json.hpp>
#include <string>

#include "drawing/stage_chart.h"
#include "options.h"
#include "screen/painter.h"
#include "screen/window.h"

// Requests of the user, by a key or a button, that the view cannot handle itself.
enum class Action {
  kNone,
  kOpenCamera,
  kOtherView,
  kPrediction,
  kHead,       // of the person in the image
  kAddToHead,  // the image, for the head so far
  kBack,       // to the live view
  kExport,     // the head
  kSnapshot,
  kClip,
  kRecord,
  kHelp
};

// Movements by pointer and arrow keys since the last frame.
struct Steering {
  float seconds = 0;
  float right = 0, down = 0;                    // in radians
  bool is_dragging = false, has_begun = false;  // begun: with this frame
  float pointer_x = 0, drag_x = 0;
};

class MainView {
 public:
  MainView(const Options& options, const Window& window, Painter& painter)
      : options_(options), window_(window), painter_(painter) {}
  virtual ~MainView() = default;

  virtual bool update() = 0;  // takes the newest image; true when there was one
  virtual Action press(int key) = 0;
  virtual void steer(const Steering& steering, const Rect& area) = 0;
  virtual void draw(const Rect& area) = 0;
  virtual Action draw_panel() = 0;

  virtual bool is_moving() const { return false; }  // by itself, without another image
  virtual std::string message() const = 0;          // message for the user
  Rect image_rect() const { return image_rect_; }
  virtual double images_per_second() const = 0;
  // Writes the results of the image, for a snapshot; null if there are none.
  virtual maquette::Saver::Companions companions() const { return nullptr; }

  // Without a user: replaces the user once a frame; returns true at the end.
  virtual bool act_alone() = 0;
  virtual std::string failure() const = 0;  // a sentence; "" where nothing failed
  virtual void add_to_report(nlohmann::ordered_json* report) const = 0;

 protected:
  const Options& options_;
  const Window& window_;
  Painter& painter_;
  Rect image_rect_;
  StageChart stages_;  // of the images
};
