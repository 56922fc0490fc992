#include "sources/android/camera2_functions.h"

#include <dlfcn.h>

#include "core/error.h"
#include "core/module.h"

#if __has_include(<camera/NdkCameraManager.h>)
#include <camera/NdkCameraManager.h>
#include <media/NdkImageReader.h>

#include <cstddef>
#include <type_traits>
#endif

namespace maq::ndk {

#if __has_include(<camera/NdkCameraManager.h>)
namespace {

// The NDK's type for one of our types.
template <class Type>
struct Theirs {
  using type = Type;
};
template <class Type>
struct Theirs<const Type> {
  using type = const typename Theirs<Type>::type;
};
template <class Type>
struct Theirs<Type*> {
  using type = typename Theirs<Type>::type*;
};
template <class Result, class... Arguments>
struct Theirs<Result(Arguments...)> {
  using type = typename Theirs<Result>::type(typename Theirs<Arguments>::type...);
};
#define MAQ_TYPE(name)       \
  template <>                \
  struct Theirs<ndk::name> { \
    using type = ::name;     \
  }
MAQ_TYPE(ACameraManager);
MAQ_TYPE(ACameraMetadata);
MAQ_TYPE(ACameraDevice);
MAQ_TYPE(ACameraCaptureSession);
MAQ_TYPE(ACaptureRequest);
MAQ_TYPE(ACameraOutputTarget);
MAQ_TYPE(ACaptureSessionOutput);
MAQ_TYPE(ACaptureSessionOutputContainer);
MAQ_TYPE(AImageReader);
MAQ_TYPE(AImage);
MAQ_TYPE(ANativeWindow);
MAQ_TYPE(camera_status_t);
MAQ_TYPE(media_status_t);
MAQ_TYPE(ACameraDevice_request_template);
MAQ_TYPE(ACameraMetadata_const_entry);
MAQ_TYPE(ACameraIdList);
MAQ_TYPE(ACameraDevice_StateCallbacks);
MAQ_TYPE(ACameraCaptureSession_stateCallbacks);
MAQ_TYPE(ACameraCaptureFailure);
MAQ_TYPE(ACameraCaptureSession_captureCallbacks);
MAQ_TYPE(AImageReader_ImageListener);
#undef MAQ_TYPE

#define MAQ_FUNCTION(name, signature) static_assert(std::is_same_v<Theirs<signature>::type, decltype(::name)>, #name);
MAQ_FUNCTIONS_OF_CAMERA2NDK(MAQ_FUNCTION)
MAQ_FUNCTIONS_OF_MEDIANDK(MAQ_FUNCTION)
#undef MAQ_FUNCTION

#define MAQ_VALUE(name) static_assert(int64_t(ndk::name) == int64_t(::name), #name)
MAQ_VALUE(ACAMERA_OK);
MAQ_VALUE(ACAMERA_ERROR_UNKNOWN);
MAQ_VALUE(ACAMERA_ERROR_INVALID_PARAMETER);
MAQ_VALUE(ACAMERA_ERROR_CAMERA_DISCONNECTED);
MAQ_VALUE(ACAMERA_ERROR_NOT_ENOUGH_MEMORY);
MAQ_VALUE(ACAMERA_ERROR_METADATA_NOT_FOUND);
MAQ_VALUE(ACAMERA_ERROR_CAMERA_DEVICE);
MAQ_VALUE(ACAMERA_ERROR_CAMERA_SERVICE);
MAQ_VALUE(ACAMERA_ERROR_STREAM_CONFIGURE_FAIL);
MAQ_VALUE(ACAMERA_ERROR_CAMERA_IN_USE);
MAQ_VALUE(ACAMERA_ERROR_MAX_CAMERA_IN_USE);
MAQ_VALUE(ACAMERA_ERROR_CAMERA_DISABLED);
MAQ_VALUE(ACAMERA_ERROR_PERMISSION_DENIED);
MAQ_VALUE(ERROR_CAMERA_IN_USE);
MAQ_VALUE(ERROR_MAX_CAMERAS_IN_USE);
MAQ_VALUE(ERROR_CAMERA_DISABLED);
MAQ_VALUE(ERROR_CAMERA_DEVICE);
MAQ_VALUE(ERROR_CAMERA_SERVICE);
MAQ_VALUE(AMEDIA_OK);
MAQ_VALUE(AMEDIA_ERROR_UNKNOWN);
MAQ_VALUE(AMEDIA_IMGREADER_NO_BUFFER_AVAILABLE);
MAQ_VALUE(TEMPLATE_PREVIEW);
MAQ_VALUE(AIMAGE_FORMAT_YUV_420_888);
MAQ_VALUE(ACAMERA_CONTROL_AE_TARGET_FPS_RANGE);
MAQ_VALUE(ACAMERA_CONTROL_AE_AVAILABLE_TARGET_FPS_RANGES);
MAQ_VALUE(ACAMERA_LENS_FACING);
MAQ_VALUE(ACAMERA_LENS_INTRINSIC_CALIBRATION);
MAQ_VALUE(ACAMERA_LENS_DISTORTION);
MAQ_VALUE(ACAMERA_SCALER_AVAILABLE_STREAM_CONFIGURATIONS);
MAQ_VALUE(ACAMERA_SCALER_AVAILABLE_MIN_FRAME_DURATIONS);
MAQ_VALUE(ACAMERA_SENSOR_ORIENTATION);
MAQ_VALUE(ACAMERA_SENSOR_INFO_ACTIVE_ARRAY_SIZE);
MAQ_VALUE(ACAMERA_SENSOR_INFO_TIMESTAMP_SOURCE);
MAQ_VALUE(ACAMERA_SENSOR_INFO_PRE_CORRECTION_ACTIVE_ARRAY_SIZE);
MAQ_VALUE(ACAMERA_DISTORTION_CORRECTION_AVAILABLE_MODES);
MAQ_VALUE(ACAMERA_LENS_FACING_FRONT);
MAQ_VALUE(ACAMERA_LENS_FACING_BACK);
MAQ_VALUE(ACAMERA_LENS_FACING_EXTERNAL);
MAQ_VALUE(ACAMERA_SCALER_AVAILABLE_STREAM_CONFIGURATIONS_OUTPUT);
MAQ_VALUE(ACAMERA_SENSOR_INFO_TIMESTAMP_SOURCE_REALTIME);
MAQ_VALUE(ACAMERA_DISTORTION_CORRECTION_MODE_OFF);
MAQ_VALUE(ACAMERA_TYPE_BYTE);
MAQ_VALUE(ACAMERA_TYPE_INT32);
MAQ_VALUE(ACAMERA_TYPE_FLOAT);
MAQ_VALUE(ACAMERA_TYPE_INT64);
#undef MAQ_VALUE

// The types of callbacks are compared, too: C code calls them.
#define MAQ_MEMBER(name, member)                                                                         \
  static_assert(sizeof(ndk::name) == sizeof(::name), #name);                                             \
  static_assert(offsetof(ndk::name, member) == offsetof(::name, member) &&                               \
                    std::is_same_v<Theirs<decltype(ndk::name::member)>::type, decltype(::name::member)>, \
                #name "::" #member)
MAQ_MEMBER(ACameraMetadata_const_entry, tag);
MAQ_MEMBER(ACameraMetadata_const_entry, type);
MAQ_MEMBER(ACameraMetadata_const_entry, count);
static_assert(offsetof(ndk::ACameraMetadata_const_entry, data) == offsetof(::ACameraMetadata_const_entry, data));
MAQ_MEMBER(ACameraIdList, numCameras);
MAQ_MEMBER(ACameraIdList, cameraIds);
MAQ_MEMBER(ACameraDevice_StateCallbacks, context);
MAQ_MEMBER(ACameraDevice_StateCallbacks, onDisconnected);
MAQ_MEMBER(ACameraDevice_StateCallbacks, onError);
MAQ_MEMBER(ACameraCaptureSession_stateCallbacks, context);
MAQ_MEMBER(ACameraCaptureSession_stateCallbacks, onClosed);
MAQ_MEMBER(ACameraCaptureSession_stateCallbacks, onReady);
MAQ_MEMBER(ACameraCaptureSession_stateCallbacks, onActive);
MAQ_MEMBER(ACameraCaptureFailure, frameNumber);
MAQ_MEMBER(ACameraCaptureFailure, wasImageCaptured);
MAQ_MEMBER(ACameraCaptureSession_captureCallbacks, context);
MAQ_MEMBER(ACameraCaptureSession_captureCallbacks, onCaptureStarted);
MAQ_MEMBER(ACameraCaptureSession_captureCallbacks, onCaptureProgressed);
MAQ_MEMBER(ACameraCaptureSession_captureCallbacks, onCaptureCompleted);
MAQ_MEMBER(ACameraCaptureSession_captureCallbacks, onCaptureFailed);
MAQ_MEMBER(ACameraCaptureSession_captureCallbacks, onCaptureSequenceCompleted);
MAQ_MEMBER(ACameraCaptureSession_captureCallbacks, onCaptureSequenceAborted);
MAQ_MEMBER(ACameraCaptureSession_captureCallbacks, onCaptureBufferLost);
MAQ_MEMBER(AImageReader_ImageListener, context);
MAQ_MEMBER(AImageReader_ImageListener, onImageAvailable);
#undef MAQ_MEMBER

}  // namespace
#endif

namespace {

constexpr char kRemedy[] = " Cameras need Android 7 (API level 24) or newer.";

class Library {
 public:
  // Stays open: the threads of Android's cameras may run to the end of the process.
  explicit Library(const std::string& path) : path_(path) {
    const LibraryOpening opened = open_library(path);
    if (opened.library == nullptr) {
      throw Error(MAQ_ERROR_RUNTIME_LIBRARY, "Android's cameras need ", path,
                  ", which cannot be opened: ", opened.error, ".", kRemedy);
    }
    library_ = opened.library;
  }

  template <class Function>
  void find(const char* name, Function*& function) const {
    function = reinterpret_cast<Function*>(dlsym(library_, name));
    if (function == nullptr) {
      throw Error(MAQ_ERROR_RUNTIME_LIBRARY, "Android's cameras need the function ", name, ", which ", path_,
                  " does not have.", kRemedy);
    }
  }

 private:
  std::string path_;
  void* library_;
};

}  // namespace

Functions load_functions(const std::string& camera_library, const std::string& media_library) {
  Functions functions;
  const Library camera(camera_library), media(media_library);
#define MAQ_FUNCTION(name, signature) camera.find(#name, functions.name);
  MAQ_FUNCTIONS_OF_CAMERA2NDK(MAQ_FUNCTION)
#undef MAQ_FUNCTION
#define MAQ_FUNCTION(name, signature) media.find(#name, functions.name);
  MAQ_FUNCTIONS_OF_MEDIANDK(MAQ_FUNCTION)
#undef MAQ_FUNCTION
  return functions;
}

}  // namespace maq::ndk
