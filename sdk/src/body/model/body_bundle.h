// The content of a bundle for bodies (docs/reference/formats.md): one body, and no network.
#pragma once

#include <memory>

#include "body/model/body_model.h"
#include "nn/bundle.h"

namespace maq::body {

// Throws MAQ_ERROR_UNSUPPORTED for a bundle of another task, MAQ_ERROR_BAD_BUNDLE if the manifest names no body, and
// the errors of read_body().
std::shared_ptr<const BodyModel> model_of_bundle(const Bundle& bundle);

}  // namespace maq::body
