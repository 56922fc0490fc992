#include "sources/source.h"

#include "core/error.h"
#include "sources/camera_backend.h"

namespace maq {
namespace {

[[noreturn]] void refuse_control(maq_source_control which) {
  throw Error(MAQ_ERROR_UNSUPPORTED, "The source has no control ", int(which), " (maq_source_control).");
}

[[noreturn]] void refuse_to_seek() {
  throw Error(MAQ_ERROR_UNSUPPORTED, "This source cannot seek; clips, recordings and stubs can.");
}

}  // namespace

// The defaults: a camera or another source has none of these.
maq_source_control_info Camera::control(maq_source_control which) { refuse_control(which); }
void Camera::set_control(maq_source_control which, double) { refuse_control(which); }
void Camera::seek(int64_t) { refuse_to_seek(); }
maq_source_control_info Source::control(maq_source_control which) { refuse_control(which); }
void Source::set_control(maq_source_control which, double) { refuse_control(which); }
void Source::seek(int64_t) { refuse_to_seek(); }
int Source::event_fd() {
  throw Error(MAQ_ERROR_UNSUPPORTED,
              "Frames of this source need no waiting; cameras and sources with live=1 have events.");
}

}  // namespace maq
