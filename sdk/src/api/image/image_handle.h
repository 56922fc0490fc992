#pragma once

#include "api/handle.h"
#include "image/rendered_image.h"
#include "maquette/scene.h"

constexpr uint32_t kDefaultImagePool = 4;  // images of a renderer whose config gives no number

struct maq_image : maq::HandleOf<maq::HandleKind::kImage> {
  maq::RenderedImage image;
  maq_scene_render_stats scene_stats{};  // struct_size is 0 for images of heads
  maq::BoundedPool<maq_image>::Deleter deleter;
};
