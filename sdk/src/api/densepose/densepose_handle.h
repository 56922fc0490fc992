#pragma once

#include "api/handle.h"
#include "densepose/densepose.h"
#include "maquette/densepose.h"

namespace maq {

// The bundle that a config without one means.
inline constexpr char kDensePoseBundle[] = "densepose-b-int8";

// The caller's config on top of the defaults; NULL means the defaults. `name` begins error texts.
maq_densepose_config read_densepose_config(const maq_densepose_config* given, const char* name);

// Throws ArgumentError for what is out of range; `name` is that of the config.
DensePoseSettings densepose_settings(const maq_densepose_config& config, const char* name);

// Throws ArgumentError unless it is one.
float require_roll(float roll_rad);

// Throws ArgumentError unless `image`, of the argument `frame`, has the size of a result's planes.
void require_frame_of(const DensePlanes& planes, const ImageView& image);

}  // namespace maq

struct maq_densepose_result : maq::HandleOf<maq::HandleKind::kDensePoseResult> {
  maq::DensePoseResult result;
  maq::BoundedPool<maq_densepose_result>::Deleter deleter;
};

struct maq_densepose : maq::HandleOf<maq::HandleKind::kDensePose> {
  maq_densepose(std::shared_ptr<maq::ContextState> of, std::unique_ptr<maq::DensePose> made, size_t pool_size)
      : state(std::move(of)), densepose(std::move(made)), results(pool_size, "results") {}
  std::shared_ptr<maq::ContextState> state;
  std::unique_ptr<maq::DensePose> densepose;
  maq::BoundedPool<maq_densepose_result> results;
};
