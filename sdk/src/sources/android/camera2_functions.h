// The functions of Android's NDK that a camera needs, as a table, so that a test can take Android's place. Names, types
// and values equal the NDK's headers <camera/Ndk*.h> and <media/NdkImage*.h>; builds do without these. Where they are,
// camera2_functions.cpp compares each declaration with them.
#pragma once

#include <cstdint>
#include <string>

namespace maq::ndk {

struct ACameraManager;
struct ACameraMetadata;
struct ACameraDevice;
struct ACameraCaptureSession;
struct ACaptureRequest;
struct ACameraOutputTarget;
struct ACaptureSessionOutput;
struct ACaptureSessionOutputContainer;
struct AImageReader;
struct AImage;
struct ANativeWindow;

enum camera_status_t : int {
  ACAMERA_OK = 0,
  ACAMERA_ERROR_UNKNOWN = -10000,
  ACAMERA_ERROR_INVALID_PARAMETER = -10001,
  ACAMERA_ERROR_CAMERA_DISCONNECTED = -10002,
  ACAMERA_ERROR_NOT_ENOUGH_MEMORY = -10003,
  ACAMERA_ERROR_METADATA_NOT_FOUND = -10004,
  ACAMERA_ERROR_CAMERA_DEVICE = -10005,
  ACAMERA_ERROR_CAMERA_SERVICE = -10006,
  ACAMERA_ERROR_STREAM_CONFIGURE_FAIL = -10009,
  ACAMERA_ERROR_CAMERA_IN_USE = -10010,
  ACAMERA_ERROR_MAX_CAMERA_IN_USE = -10011,
  ACAMERA_ERROR_CAMERA_DISABLED = -10012,
  ACAMERA_ERROR_PERMISSION_DENIED = -10013,
};

// Errors of the callback onError.
enum : int {
  ERROR_CAMERA_IN_USE = 1,
  ERROR_MAX_CAMERAS_IN_USE = 2,
  ERROR_CAMERA_DISABLED = 3,
  ERROR_CAMERA_DEVICE = 4,
  ERROR_CAMERA_SERVICE = 5,
};

enum media_status_t : int {
  AMEDIA_OK = 0,
  AMEDIA_ERROR_UNKNOWN = -10000,
  AMEDIA_IMGREADER_NO_BUFFER_AVAILABLE = -30001,
  AMEDIA_IMGREADER_MAX_IMAGES_ACQUIRED = -30002,
  AMEDIA_IMGREADER_CANNOT_LOCK_IMAGE = -30003,
};

enum ACameraDevice_request_template : int { TEMPLATE_PREVIEW = 1 };

constexpr int32_t AIMAGE_FORMAT_YUV_420_888 = 0x23;

// Tags of metadata, with the types of their values.
constexpr uint32_t ACAMERA_CONTROL_AE_TARGET_FPS_RANGE = 0x10005;                   // int32[2]
constexpr uint32_t ACAMERA_CONTROL_AE_AVAILABLE_TARGET_FPS_RANGES = 0x10014;        // int32[2 n]
constexpr uint32_t ACAMERA_LENS_FACING = 0x80005;                                   // byte
constexpr uint32_t ACAMERA_LENS_INTRINSIC_CALIBRATION = 0x8000a;                    // float[5]
constexpr uint32_t ACAMERA_LENS_DISTORTION = 0x8000d;                               // float[5]
constexpr uint32_t ACAMERA_SCALER_AVAILABLE_STREAM_CONFIGURATIONS = 0xd000a;        // int32[4 n]
constexpr uint32_t ACAMERA_SCALER_AVAILABLE_MIN_FRAME_DURATIONS = 0xd000b;          // int64[4 n]
constexpr uint32_t ACAMERA_SENSOR_ORIENTATION = 0xe000e;                            // int32
constexpr uint32_t ACAMERA_SENSOR_INFO_ACTIVE_ARRAY_SIZE = 0xf0000;                 // int32[4]
constexpr uint32_t ACAMERA_SENSOR_INFO_TIMESTAMP_SOURCE = 0xf0008;                  // byte
constexpr uint32_t ACAMERA_SENSOR_INFO_PRE_CORRECTION_ACTIVE_ARRAY_SIZE = 0xf000a;  // int32[4]
constexpr uint32_t ACAMERA_DISTORTION_CORRECTION_AVAILABLE_MODES = 0x1b0001;        // byte[n]

// Values of these.
constexpr uint8_t ACAMERA_LENS_FACING_FRONT = 0;
constexpr uint8_t ACAMERA_LENS_FACING_BACK = 1;
constexpr uint8_t ACAMERA_LENS_FACING_EXTERNAL = 2;
constexpr int32_t ACAMERA_SCALER_AVAILABLE_STREAM_CONFIGURATIONS_OUTPUT = 0;
constexpr uint8_t ACAMERA_SENSOR_INFO_TIMESTAMP_SOURCE_REALTIME = 1;
constexpr uint8_t ACAMERA_DISTORTION_CORRECTION_MODE_OFF = 0;

constexpr uint8_t ACAMERA_TYPE_BYTE = 0;
constexpr uint8_t ACAMERA_TYPE_INT32 = 1;
constexpr uint8_t ACAMERA_TYPE_FLOAT = 2;
constexpr uint8_t ACAMERA_TYPE_INT64 = 3;

struct ACameraMetadata_const_entry {
  uint32_t tag;
  uint8_t type;
  uint32_t count;
  union {
    const uint8_t* u8;
    const int32_t* i32;
    const float* f;
    const int64_t* i64;
  } data;
};

struct ACameraIdList {
  int numCameras;
  const char** cameraIds;
};

struct ACameraDevice_StateCallbacks {
  void* context;
  void (*onDisconnected)(void* context, ACameraDevice* device);
  void (*onError)(void* context, ACameraDevice* device, int error);
};

struct ACameraCaptureSession_stateCallbacks {
  void* context;
  void (*onClosed)(void* context, ACameraCaptureSession* session);
  void (*onReady)(void* context, ACameraCaptureSession* session);
  void (*onActive)(void* context, ACameraCaptureSession* session);
};

struct ACameraCaptureFailure {
  int64_t frameNumber;
  int reason;
  int sequenceId;
  bool wasImageCaptured;
};

// Null pointers are not called.
struct ACameraCaptureSession_captureCallbacks {
  void* context;
  void (*onCaptureStarted)(void* context, ACameraCaptureSession*, const ACaptureRequest*, int64_t timestamp);
  void (*onCaptureProgressed)(void* context, ACameraCaptureSession*, ACaptureRequest*, const ACameraMetadata*);
  void (*onCaptureCompleted)(void* context, ACameraCaptureSession*, ACaptureRequest*, const ACameraMetadata*);
  void (*onCaptureFailed)(void* context, ACameraCaptureSession*, ACaptureRequest*, ACameraCaptureFailure*);
  void (*onCaptureSequenceCompleted)(void* context, ACameraCaptureSession*, int sequence, int64_t frame);
  void (*onCaptureSequenceAborted)(void* context, ACameraCaptureSession*, int sequence);
  void (*onCaptureBufferLost)(void* context, ACameraCaptureSession*, ACaptureRequest*, ANativeWindow*, int64_t frame);
};

struct AImageReader_ImageListener {
  void* context;
  void (*onImageAvailable)(void* context, AImageReader* reader);
};

// Each function and its type, by the library that has it.
#define MAQ_FUNCTIONS_OF_CAMERA2NDK(F)                                                                              \
  F(ACameraManager_create, ACameraManager*())                                                                       \
  F(ACameraManager_delete, void(ACameraManager*))                                                                   \
  F(ACameraManager_getCameraIdList, camera_status_t(ACameraManager*, ACameraIdList**))                              \
  F(ACameraManager_deleteCameraIdList, void(ACameraIdList*))                                                        \
  F(ACameraManager_getCameraCharacteristics, camera_status_t(ACameraManager*, const char*, ACameraMetadata**))      \
  F(ACameraManager_openCamera,                                                                                      \
    camera_status_t(ACameraManager*, const char*, ACameraDevice_StateCallbacks*, ACameraDevice**))                  \
  F(ACameraMetadata_getConstEntry, camera_status_t(const ACameraMetadata*, uint32_t, ACameraMetadata_const_entry*)) \
  F(ACameraMetadata_free, void(ACameraMetadata*))                                                                   \
  F(ACameraDevice_close, camera_status_t(ACameraDevice*))                                                           \
  F(ACameraDevice_createCaptureRequest,                                                                             \
    camera_status_t(const ACameraDevice*, ACameraDevice_request_template, ACaptureRequest**))                       \
  F(ACameraDevice_createCaptureSession,                                                                             \
    camera_status_t(ACameraDevice*, const ACaptureSessionOutputContainer*,                                          \
                    const ACameraCaptureSession_stateCallbacks*, ACameraCaptureSession**))                          \
  F(ACaptureSessionOutputContainer_create, camera_status_t(ACaptureSessionOutputContainer**))                       \
  F(ACaptureSessionOutputContainer_add,                                                                             \
    camera_status_t(ACaptureSessionOutputContainer*, const ACaptureSessionOutput*))                                 \
  F(ACaptureSessionOutputContainer_free, void(ACaptureSessionOutputContainer*))                                     \
  F(ACaptureSessionOutput_create, camera_status_t(ANativeWindow*, ACaptureSessionOutput**))                         \
  F(ACaptureSessionOutput_free, void(ACaptureSessionOutput*))                                                       \
  F(ACameraOutputTarget_create, camera_status_t(ANativeWindow*, ACameraOutputTarget**))                             \
  F(ACameraOutputTarget_free, void(ACameraOutputTarget*))                                                           \
  F(ACaptureRequest_addTarget, camera_status_t(ACaptureRequest*, const ACameraOutputTarget*))                       \
  F(ACaptureRequest_getConstEntry, camera_status_t(const ACaptureRequest*, uint32_t, ACameraMetadata_const_entry*)) \
  F(ACaptureRequest_setEntry_i32, camera_status_t(ACaptureRequest*, uint32_t, uint32_t, const int32_t*))            \
  F(ACaptureRequest_free, void(ACaptureRequest*))                                                                   \
  F(ACameraCaptureSession_setRepeatingRequest,                                                                      \
    camera_status_t(ACameraCaptureSession*, ACameraCaptureSession_captureCallbacks*, int, ACaptureRequest**, int*)) \
  F(ACameraCaptureSession_close, void(ACameraCaptureSession*))

#define MAQ_FUNCTIONS_OF_MEDIANDK(F)                                                           \
  F(AImageReader_new, media_status_t(int32_t, int32_t, int32_t, int32_t, AImageReader**))      \
  F(AImageReader_delete, void(AImageReader*))                                                  \
  F(AImageReader_getWindow, media_status_t(AImageReader*, ANativeWindow**))                    \
  F(AImageReader_setImageListener, media_status_t(AImageReader*, AImageReader_ImageListener*)) \
  F(AImageReader_acquireNextImage, media_status_t(AImageReader*, AImage**))                    \
  F(AImage_delete, void(AImage*))                                                              \
  F(AImage_getWidth, media_status_t(const AImage*, int32_t*))                                  \
  F(AImage_getHeight, media_status_t(const AImage*, int32_t*))                                 \
  F(AImage_getTimestamp, media_status_t(const AImage*, int64_t*))                              \
  F(AImage_getPlaneData, media_status_t(const AImage*, int, uint8_t**, int*))                  \
  F(AImage_getPlanePixelStride, media_status_t(const AImage*, int, int32_t*))                  \
  F(AImage_getPlaneRowStride, media_status_t(const AImage*, int, int32_t*))

template <class Type>
using PointerTo = Type*;

struct Functions {
#define MAQ_FUNCTION(name, signature) PointerTo<signature> name = nullptr;
  MAQ_FUNCTIONS_OF_CAMERA2NDK(MAQ_FUNCTION)
  MAQ_FUNCTIONS_OF_MEDIANDK(MAQ_FUNCTION)
#undef MAQ_FUNCTION
};

// Opens the two libraries and finds every function. Throws MAQ_ERROR_RUNTIME_LIBRARY for a library that cannot be
// opened or lacks one.
Functions load_functions(const std::string& camera_library = "libcamera2ndk.so",
                         const std::string& media_library = "libmediandk.so");

}  // namespace maq::ndk
