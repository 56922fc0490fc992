// Options of the demo's command line.
#pragma once

#include <app/edge_picture.h>
#include <app/live_densepose.h>
#include <app/live_edges.h>
#include <app/prediction/live_prediction.h>
#include <array>
#include <string>
#include <vector>

constexpr char kFirstCamera[] = "camera:";
constexpr char kRenderedSolids[] = "stub:solids";

// The views of people, and a scene's photo against its rendering.
enum class View { kCamera, kParts, kContours, kMask, kBoxes, kTryOn };
constexpr std::array<const char*, 6> kViewNames = {"camera", "parts", "contours", "mask", "boxes", "try-on"};
enum class Compare { kNone, kSlider, kError };
constexpr std::array<const char*, 3> kCompareNames = {"none", "slider", "error"};

// In the order of maq_head_shading.
constexpr std::array<const char*, 5> kShadingNames = {"colour", "shape", "normals", "template", "depth"};

// In the order of maq_predictor_method.
constexpr std::array<const char*, 3> kMethodNames = {"auto", "last", "motion"};
constexpr double kMinAheadMs = 33, kMaxAheadMs = 1000;

struct Options {
  std::string source = kFirstCamera;  // or a file, a folder with a capture
  bool edges = false;                 // of the source, rather than people
  bool head = false;                  // of the person in its first image
  bool predict = false;               // the source with its predicted frames
  maquette::PredictionChoice prediction;
  maq_head_shading shading = MAQ_HEAD_SHADING_COLOUR;
  double fit_seconds = 3;  // of a head
  std::string heads_bundle;
  View view = View::kParts;
  bool mesh = true, person_colours = true;
  std::string texture, capture, scene_bundle;
  Compare compare = Compare::kNone;
  std::string bundle;
  maquette::EdgeLayer layer = maquette::EdgeLayer::kDepth;
  std::string edges_bundle;
  maquette::LiveEdgesOptions edges_model;
  maq_densepose_config model = maquette::default_densepose_config();
  maquette::LiveOptions live;
  int width_px = 1280, height_px = 800;
  bool headless = false;
  uint64_t frames = 30;            // when headless
  std::vector<double> pointer_px;  // when headless: x and y; or nothing
  std::string screenshot, out;
};
