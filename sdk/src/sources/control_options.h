// The options of a source's URI that set controls of a camera: "?exposure=10000&focus=auto".
#pragma once

#include <vector>

#include "sources/camera_backend.h"
#include "sources/uri.h"

namespace maq {

// For the list of options that a source knows.
constexpr char kControlOptions[] = "exposure, gain, focus, white_balance and brightness";

// Removes the controls from the list of options and returns them, in this order. LiveSource sets them. Throws
// MAQ_ERROR_INVALID_ARGUMENT for a value that is neither a number nor "auto".
std::vector<ControlSetting> take_control_options(SourceUri& uri);

}  // namespace maq
