#pragma once

#include <optional>
#include <string>
#include <vector>

#include "api/handle.h"
#include "maquette/scene.h"
#include "scene/capture/capture.h"
#include "scene/format/scene.h"

struct maq_capture : maq::HandleOf<maq::HandleKind::kCapture> {
  explicit maq_capture(maq::Capture opened) : capture(std::move(opened)) {}
  maq::Capture capture;
  std::vector<std::string> dropped;  // as sentences
};

struct maq_scene : maq::HandleOf<maq::HandleKind::kScene> {
  explicit maq_scene(maq::Scene made, const std::optional<maq_scene_build_stats>& stats = {})
      : scene(std::move(made)), build_stats(stats) {}
  maq::Scene scene;
  std::optional<maq_scene_build_stats> build_stats;  // nothing for scenes from files
};
