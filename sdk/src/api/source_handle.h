#pragma once

#include <vector>

#include "api/frame_handle.h"
#include "maquette/source.h"
#include "sources/registry.h"

namespace maq {

// The caller's config on top of the defaults. `name` begins error texts.
maq_source_config read_source_config(const maq_source_config* given, const char* name);

// Throws ArgumentError for what is out of range.
SourceSettings source_settings(const maq_source_config& config, const Log& log);

}  // namespace maq

struct maq_source : maq::Handle {
  maq_source(std::string opened, std::unique_ptr<maq::Source> made, size_t pool_size)
      : uri(std::move(opened)), source(std::move(made)), frames(pool_size, "frames") {}
  std::string uri;
  std::unique_ptr<maq::Source> source;
  maq::BoundedPool<maq_frame> frames;
};

struct maq_camera_list : maq::Handle {
  std::vector<maq::CameraListing> cameras;
};
