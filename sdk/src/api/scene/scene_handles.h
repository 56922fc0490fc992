#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "api/handle.h"
#include "maquette/scene.h"
#include "scene/capture/capture.h"
#include "scene/format/scene.h"
#include "scene/splats/splats.h"

struct maq_capture : maq::HandleOf<maq::HandleKind::kCapture> {
  explicit maq_capture(maq::Capture opened) : capture(std::move(opened)) {}
  maq::Capture capture;
  std::vector<std::string> dropped;  // as sentences
};

struct maq_scene : maq::HandleOf<maq::HandleKind::kScene> {
  explicit maq_scene(maq::Scene made, const std::optional<maq_scene_build_stats>& stats = {})
      : scene(std::move(made)), build_stats(stats) {}
  explicit maq_scene(maq::Splats made, const std::optional<maq_scene_build_stats>& stats = {})
      : splats(std::make_shared<const maq::Splats>(std::move(made))), build_stats(stats) {}
  maq::Scene scene;                                  // empty for splats
  std::shared_ptr<const maq::Splats> splats;         // otherwise null
  std::optional<maq_scene_build_stats> build_stats;  // nothing for scenes from files
};
