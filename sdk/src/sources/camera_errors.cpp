#include "sources/camera_errors.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "core/error.h"

namespace maq {

maq_status camera_status(int error) {
  switch (error) {
    case ENOENT: return MAQ_ERROR_NOT_FOUND;
    case EACCES:
    case EPERM: return MAQ_ERROR_NO_PERMISSION;
    case EBUSY:
    case ENOSPC: return MAQ_ERROR_BUSY;
    case ENOMEM:
    case EAGAIN:
    case EMFILE:
    case ENFILE: return MAQ_ERROR_OUT_OF_MEMORY;
    case ENODEV:
    case ENXIO:
    case EIO:
    case EBADF: return MAQ_ERROR_DEVICE_LOST;
    default: return MAQ_ERROR_UNSUPPORTED;
  }
}

const char* camera_remedy(maq_status status) {
  switch (status) {
    case MAQ_ERROR_NOT_FOUND: return " Is the camera plugged in, and is this its name?";
    case MAQ_ERROR_NO_PERMISSION:
      return " Cameras belong to the group \"video\": add the user to it (sudo usermod -aG video $USER), log in again.";
    case MAQ_ERROR_BUSY: return " Another program, or another source of this one, uses the camera; close it.";
    case MAQ_ERROR_OUT_OF_MEMORY: return " Ask for a smaller size or fewer frames, or close other files.";
    case MAQ_ERROR_DEVICE_LOST: return " The device is gone; plug it in again.";
    default: return "";
  }
}

bool is_device_lost(int error) { return camera_status(error) == MAQ_ERROR_DEVICE_LOST; }

void fail_camera(const std::string& name, const std::string& what, int error, const char* hint) {
  error = std::abs(error);
  const maq_status status = camera_status(error);
  // The kernel's word for a USB bus that has no bandwidth left.
  const char* remedy =
      error == ENOSPC
          ? " The USB bus has no room left: ask for a smaller size or rate, or plug the camera in elsewhere."
          : camera_remedy(status);
  throw Error(status, name, " ", what, ": ", std::strerror(error), ".", *remedy == '\0' ? hint : remedy);
}

void refuse_camera(const std::string& name, const std::string& what) {
  throw Error(MAQ_ERROR_UNSUPPORTED, name, " ", what, ".");
}

}  // namespace maq
