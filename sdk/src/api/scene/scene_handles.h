#pragma once

#include <string>
#include <vector>

#include "api/handle.h"
#include "maquette/scene.h"
#include "scene/capture/capture.h"
#include "scene/format/scene.h"
#include "scene/render/scene_renderer.h"

struct maq_capture : maq::HandleOf<maq::HandleKind::kCapture> {
  explicit maq_capture(maq::Capture opened) : capture(std::move(opened)) {}
  maq::Capture capture;
  std::vector<std::string> dropped;  // as sentences
};

struct maq_scene : maq::HandleOf<maq::HandleKind::kScene> {
  explicit maq_scene(maq::Scene made) : scene(std::move(made)) {}
  maq::Scene scene;
};

struct maq_scene_image : maq::HandleOf<maq::HandleKind::kSceneImage> {
  maq::RenderedImage image;
  maq::BoundedPool<maq_scene_image>::Deleter deleter;
};
