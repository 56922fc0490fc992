#include "sources/android/camera2_errors.h"

#include "core/error.h"

namespace maq {
namespace {

struct Meaning {
  ndk::camera_status_t status;
  maq_status maq;
  const char* text;
  const char* remedy;
};
const Meaning kMeanings[] = {
    {ndk::ACAMERA_ERROR_PERMISSION_DENIED, MAQ_ERROR_NO_PERMISSION, "the app may not use cameras",
     "Grant android.permission.CAMERA: name it in the manifest and request it from the user before a camera is "
     "opened."},
    {ndk::ACAMERA_ERROR_CAMERA_DISABLED, MAQ_ERROR_NO_PERMISSION, "cameras are switched off for the app",
     "Bring the app to the foreground; a policy of the device or its privacy switch may also forbid cameras."},
    {ndk::ACAMERA_ERROR_CAMERA_IN_USE, MAQ_ERROR_BUSY, "the camera is in use",
     "Another app, or another source of this one, uses it; close it."},
    {ndk::ACAMERA_ERROR_MAX_CAMERA_IN_USE, MAQ_ERROR_BUSY, "as many cameras are open as the device can run at once",
     "Close another camera."},
    {ndk::ACAMERA_ERROR_CAMERA_DISCONNECTED, MAQ_ERROR_DEVICE_LOST, "the camera is not connected any more",
     "Open it again; plug it in again if it is an external one."},
    {ndk::ACAMERA_ERROR_CAMERA_DEVICE, MAQ_ERROR_DEVICE_LOST, "the camera device failed",
     "Open it again; restart the device if that does not help."},
    {ndk::ACAMERA_ERROR_CAMERA_SERVICE, MAQ_ERROR_DEVICE_LOST, "Android's camera service failed",
     "Open it again; restart the device if that does not help."},
    {ndk::ACAMERA_ERROR_NOT_ENOUGH_MEMORY, MAQ_ERROR_OUT_OF_MEMORY, "there is not enough memory",
     "Ask for a smaller size or fewer frames."},
    {ndk::ACAMERA_ERROR_STREAM_CONFIGURE_FAIL, MAQ_ERROR_UNSUPPORTED, "the device refuses this stream of images",
     "Ask for another size."},
    {ndk::ACAMERA_ERROR_METADATA_NOT_FOUND, MAQ_ERROR_UNSUPPORTED, "the device does not say it", "Use another camera."},
};

const Meaning* meaning_of(ndk::camera_status_t status) {
  for (const Meaning& meaning : kMeanings) {
    if (meaning.status == status) return &meaning;
  }
  return nullptr;
}

}  // namespace

maq_status camera2_maq_status(ndk::camera_status_t status) {
  const Meaning* meaning = meaning_of(status);
  return meaning == nullptr ? MAQ_ERROR_UNSUPPORTED : meaning->maq;
}

void fail_camera2(const std::string& name, const std::string& what, ndk::camera_status_t status) {
  const Meaning* meaning = meaning_of(status);
  if (meaning == nullptr) {
    throw Error(MAQ_ERROR_UNSUPPORTED, name, " ", what, ": camera_status_t ", int(status),
                ". The system's log says more (adb logcat).");
  }
  throw Error(meaning->maq, name, " ", what, ": ", meaning->text, ". ", meaning->remedy);
}

void fail_camera2_images(const std::string& name, const std::string& what, ndk::media_status_t status) {
  throw Error(MAQ_ERROR_UNSUPPORTED, name, " ", what, ": media_status_t ", int(status),
              ". Ask for another size; the system's log says more (adb logcat).");
}

const char* camera2_loss(int error) {
  switch (error) {
    case ndk::ERROR_CAMERA_IN_USE: return "another app uses the camera";
    case ndk::ERROR_MAX_CAMERAS_IN_USE: return "as many cameras are open as the device can run at once";
    case ndk::ERROR_CAMERA_DISABLED:
      return "cameras were switched off for the app, by a policy, the privacy switch, or because it left the "
             "foreground";
    case ndk::ERROR_CAMERA_SERVICE: return "Android's camera service failed";
    default: return "the camera device failed";
  }
}

}  // namespace maq
