// What more than one function of the C API takes: configs of sources and of models, checked.
#pragma once

#include "api/handles.h"

namespace maq {

// The caller's config on top of the defaults. `name` begins error texts.
maq_source_config read_source_config(const maq_source_config* given, const char* name);
maq_densepose_config read_densepose_config(const maq_densepose_config* given, const char* name);

// Throw ArgumentError for what is out of range.
SourceSettings source_settings(const maq_source_config& config, const Log& log);
DensePoseSettings densepose_settings(const maq_densepose_config& config);

// The people of `result.result` as callers get them.
void list_people(maq_densepose_result& result);

}  // namespace maq
