#include "sources/source.h"

#include "core/error.h"
#include "sources/camera_backend.h"

namespace maq {
namespace {

[[noreturn]] void refuse_control(maq_control which) {
  throw Error(MAQ_ERROR_UNSUPPORTED, "The source has no control ", int(which), " (maq_control).");
}

[[noreturn]] void refuse_to_seek() {
  throw Error(MAQ_ERROR_UNSUPPORTED, "This source cannot go to a time; clips, recordings and stubs can.");
}

}  // namespace

// By default a camera or another source can do none of these.
maq_control_info Camera::control(maq_control which) { refuse_control(which); }
void Camera::set_control(maq_control which, double) { refuse_control(which); }
void Camera::seek(int64_t) { refuse_to_seek(); }
maq_control_info Source::control(maq_control which) { refuse_control(which); }
void Source::set_control(maq_control which, double) { refuse_control(which); }
void Source::seek(int64_t) { refuse_to_seek(); }
int Source::event_fd() {
  throw Error(MAQ_ERROR_UNSUPPORTED,
              "Frames of this source need no waiting; cameras and sources with live=1 have events.");
}

}  // namespace maq
