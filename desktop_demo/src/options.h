// What the demo is started with.
#pragma once

#include <array>
#include <cstdint>
#include <maquette/maquette.hpp>
#include <string>

constexpr char kFirstCamera[] = "camera:";

enum class View { kCamera, kParts, kContours, kMask, kBoxes, kTryOn };
constexpr std::array<const char*, 6> kViewNames = {"camera", "parts", "contours", "mask", "boxes", "try-on"};

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

// What the user wants that is not the view's own business, by a key or a button.
enum class Action { kNone, kOpenCamera, kLeaveScene, kSnapshot, kClip, kRecord, kHelp };

// The pointer and the arrow keys since the last frame.
struct Steering {
  float seconds = 0;
  bool is_dragging = false, has_begun = false;  // begun: with this frame
  float pointer_x = 0, drag_x = 0, drag_y = 0;
  float arrow_x = 0, arrow_y = 0;  // to the right and down, in radians

  float right() const { return arrow_x + drag_x * 0.005f; }
  float down() const { return arrow_y + drag_y * 0.005f; }
};
