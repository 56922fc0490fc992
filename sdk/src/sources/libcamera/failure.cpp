#include "sources/libcamera/failure.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "core/error.h"

namespace maq {

void refuse_libcamera(const std::string& name, const std::string& what) {
  throw Error(MAQ_ERROR_UNSUPPORTED, "libcamera:", name, " ", what, ".");
}

void fail_libcamera(const std::string& name, const std::string& what, int error) {
  error = std::abs(error);
  maq_status status = MAQ_ERROR_UNSUPPORTED;
  const char* remedy = " LIBCAMERA_LOG_LEVELS=*:INFO in the environment shows what libcamera says to it.";
  switch (error) {
    case EBUSY:
      status = MAQ_ERROR_BUSY;
      remedy = " Another program, or another source of this one, uses the camera; close it.";
      break;
    case ENOSPC:
      status = MAQ_ERROR_BUSY;
      remedy = " The USB bus has no room left: ask for a smaller size, or plug the camera in elsewhere.";
      break;
    case EACCES:
    case EPERM:
      status = MAQ_ERROR_NO_PERMISSION;
      remedy =
          " Cameras belong to the group \"video\": add the user to it (sudo usermod -aG video $USER), log in again.";
      break;
    case ENOMEM:
    case EMFILE:
    case ENFILE:
      status = MAQ_ERROR_OUT_OF_MEMORY;
      remedy = " Ask for a smaller size or fewer frames, or close other files.";
      break;
    case ENODEV:
    case ENXIO:
    case EIO:
      status = MAQ_ERROR_DEVICE_LOST;
      remedy = " The camera is gone; plug it in again.";
      break;
  }
  throw Error(status, "libcamera:", name, " ", what, ": ", std::strerror(error), ".", remedy);
}

}  // namespace maq
