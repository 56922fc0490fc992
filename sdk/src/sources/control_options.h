// The options of a source's URI that set controls of a camera: "?exposure=10000&focus=auto".
#pragma once

#include <vector>

#include "sources/camera_backend.h"
#include "sources/uri.h"

namespace maq {

// For the list of options that a source knows.
constexpr char kControlOptions[] = "exposure, gain, focus, white_balance and brightness";

// Takes those options off the list: what is to be set, in this order. LiveSource sets it.
// Throws MAQ_ERROR_INVALID_ARGUMENT for what is neither a number nor "auto".
std::vector<ControlSetting> take_control_options(SourceUri& uri);

}  // namespace maq
