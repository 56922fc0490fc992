// Android's cameras in memory, for the functions of maq::ndk: what the NDK does, every way it may fail, and the
// mistakes that end an app on a phone, noted in misuse().
#pragma once

#include <algorithm>
#include <climits>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/clock.h"
#include "sources/android/camera2_functions.h"

namespace maq::ndk {

struct ACameraManager {};
struct ACameraOutputTarget {};
struct ACaptureSessionOutput {};
struct ACaptureSessionOutputContainer {};
struct ANativeWindow {};

// The values of each tag, in memory of its own.
struct ACameraMetadata {
  struct Values {
    uint8_t type;
    std::vector<uint8_t> bytes;
    uint32_t count;
  };
  std::map<uint32_t, Values> tags;

  template <class Value>
  void set(uint32_t tag, const std::vector<Value>& values) {
    static_assert(sizeof(Value) == 1 || sizeof(Value) == 4 || sizeof(Value) == 8);
    const uint8_t type = std::is_floating_point_v<Value> ? ACAMERA_TYPE_FLOAT
                         : sizeof(Value) == 1            ? ACAMERA_TYPE_BYTE
                         : sizeof(Value) == 4            ? ACAMERA_TYPE_INT32
                                                         : ACAMERA_TYPE_INT64;
    Values& found = tags[tag] = {type, std::vector<uint8_t>(values.size() * sizeof(Value)), uint32_t(values.size())};
    if (!values.empty()) std::memcpy(found.bytes.data(), values.data(), found.bytes.size());
  }
  camera_status_t get(uint32_t tag, ACameraMetadata_const_entry* entry) const {
    const auto found = tags.find(tag);
    if (found == tags.end()) return ACAMERA_ERROR_METADATA_NOT_FOUND;
    *entry = {tag, found->second.type, found->second.count, {found->second.bytes.data()}};
    return ACAMERA_OK;
  }
};

struct ACaptureRequest {
  ACameraMetadata settings;
};
struct ACameraDevice {
  ACameraDevice_StateCallbacks callbacks;
};
struct ACameraCaptureSession {};

struct AImage {
  int32_t width, height;
  int64_t timestamp_ns;
  std::vector<uint8_t> memory;
  struct Plane {
    size_t begin;
    int bytes;
    int32_t row_stride, pixel_stride;
  } planes[3];
  AImageReader* reader;
  bool has_null_plane;
};

struct AImageReader {
  int32_t width, height, max_images;
  AImageReader_ImageListener listener{};
  ANativeWindow window;
  std::deque<AImage*> queue;
  int acquired = 0;
};

}  // namespace maq::ndk

class FakeCamera2 {
 public:
  using Status = maq::ndk::camera_status_t;
  using MediaStatus = maq::ndk::media_status_t;

  enum class Layout { kPlanar, kUv, kVu, kOdd };

  struct FakeCamera {
    std::string id;
    maq::ndk::ACameraMetadata metadata;
  };
  std::vector<FakeCamera> cameras;
  // Layout of the images that are delivered from now on.
  Layout layout = Layout::kVu;
  int padding = 0;  // bytes behind each row
  std::optional<std::pair<int, int>> size;
  std::optional<int64_t> timestamp_ns;
  // Strides of the chroma planes that a broken device reports.
  std::optional<int32_t> row_stride, pixel_stride;
  int missing_bytes = 0;
  bool has_null_plane = false;

  FakeCamera2() {
    current() = this;
    cameras = {camera("0", maq::ndk::ACAMERA_LENS_FACING_BACK), camera("1", maq::ndk::ACAMERA_LENS_FACING_FRONT)};
  }
  ~FakeCamera2() { current() = nullptr; }

  static FakeCamera camera(const std::string& id, uint8_t facing) {
    namespace ndk = maq::ndk;
    constexpr int32_t kYuv = ndk::AIMAGE_FORMAT_YUV_420_888, kJpeg = 0x100;
    FakeCamera made{id, {}};
    made.metadata.set<uint8_t>(ndk::ACAMERA_LENS_FACING, {facing});
    made.metadata.set<uint8_t>(ndk::ACAMERA_SENSOR_INFO_TIMESTAMP_SOURCE, {0});
    made.metadata.set<int32_t>(ndk::ACAMERA_SCALER_AVAILABLE_STREAM_CONFIGURATIONS,
                               {kJpeg, 4000, 3000, 0, kYuv, 1280, 720, 0, kYuv, 640, 480, 0,
                                kYuv,  320,  240,  0, kYuv, 32,   24,  0, kYuv, 100, 100, 1});
    made.metadata.set<int64_t>(ndk::ACAMERA_SCALER_AVAILABLE_MIN_FRAME_DURATIONS,
                               {kYuv, 1280, 720, 50000000, kYuv, 640, 480, 16666666});
    made.metadata.set<int32_t>(ndk::ACAMERA_CONTROL_AE_AVAILABLE_TARGET_FPS_RANGES, {15, 15, 15, 30, 30, 30, 7, 30});
    return made;
  }

  // The functions, each of which comes to this object.
  static maq::ndk::Functions functions() {
    maq::ndk::Functions all;
#define MAQ_FUNCTION(name, signature) all.name = &FakeCamera2::name;
    MAQ_FUNCTIONS_OF_CAMERA2NDK(MAQ_FUNCTION)
    MAQ_FUNCTIONS_OF_MEDIANDK(MAQ_FUNCTION)
#undef MAQ_FUNCTION
    return all;
  }

  // --- what a test does

  // From now on the function fails `times` times with `error`, after so many calls that work.
  void break_call(const std::string& name, int error, int after = 0, int times = INT_MAX) {
    std::lock_guard<std::mutex> lock(mutex_);
    faults_[name] = {error, after, times};
  }
  void mend() {
    std::lock_guard<std::mutex> lock(mutex_);
    faults_.clear();
  }

  // An image arrives, and Android's thread, which is this one, says so. False when nothing streams or no memory for an
  // image is left: the frame is lost.
  bool deliver(uint8_t seed) {
    maq::ndk::AImageReader_ImageListener listener{};
    maq::ndk::AImageReader* reader = nullptr;
    {
      std::lock_guard<std::mutex> lock(mutex_);
      if (!streaming_ || reader_ == nullptr) return false;
      if (int(reader_->queue.size()) + reader_->acquired >= reader_->max_images) return false;
      reader_->queue.push_back(make_image(seed));
      reader = reader_;
      listener = reader_->listener;
      if (listener.onImageAvailable == nullptr) return true;
      ++callbacks_;
    }
    listener.onImageAvailable(listener.context, reader);
    end_callback();
    return true;
  }
  // The device could not deliver an image: its capture failed (`is_whole`: but for its metadata), or its memory was
  // lost.
  void fail_capture(bool is_whole = false) {
    maq::ndk::ACameraCaptureFailure failure{0, 1, 0, is_whole};
    const auto callbacks = begin_capture_callback();
    callbacks.onCaptureFailed(callbacks.context, nullptr, nullptr, &failure);
    end_callback();
  }
  void lose_buffer() {
    const auto callbacks = begin_capture_callback();
    callbacks.onCaptureBufferLost(callbacks.context, nullptr, nullptr, nullptr, 0);
    end_callback();
  }
  // Says that there is an image where there is none.
  void announce() {
    maq::ndk::AImageReader_ImageListener listener{};
    {
      std::lock_guard<std::mutex> lock(mutex_);
      listener = last_listener_;
    }
    listener.onImageAvailable(listener.context, nullptr);
  }
  // Android takes the camera away; `error` 0: onDisconnected. Also after the device was closed, as old Androids do.
  void lose(int error = 0) {
    maq::ndk::ACameraDevice_StateCallbacks callbacks{};
    {
      std::lock_guard<std::mutex> lock(mutex_);
      streaming_ = false;
      callbacks = last_callbacks_;
      ++callbacks_;
    }
    if (error == 0) {
      callbacks.onDisconnected(callbacks.context, nullptr);
    } else {
      callbacks.onError(callbacks.context, nullptr, error);
    }
    end_callback();
  }

  // Objects that were made and are not freed.
  size_t alive() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return alive_.size();
  }
  std::string misuse() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return misuse_;
  }
  int opened() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return opened_;
  }
  bool streaming() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return streaming_;
  }
  std::string opened_id() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return opened_id_;
  }
  // That streaming began with.
  std::pair<int, int> rates() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return rates_;
  }

  // The pixels that deliver() writes.
  static uint8_t luma(int x, int y, uint8_t seed) { return uint8_t(seed + 3 * x + 5 * y); }
  static uint8_t chroma(bool is_v, int x, int y, uint8_t seed) {
    return uint8_t(is_v ? seed + 11 * x + 2 * y + 90 : seed + 7 * x + 13 * y + 40);
  }

  // --- what the camera calls

  static maq::ndk::ACameraManager* ACameraManager_create() {
    std::lock_guard<std::mutex> lock(self().mutex_);
    if (self().fails("ACameraManager_create") != 0) return nullptr;
    return self().make<maq::ndk::ACameraManager>();
  }
  static void ACameraManager_delete(maq::ndk::ACameraManager* manager) { self().end("ACameraManager", manager); }
  static Status ACameraManager_getCameraIdList(maq::ndk::ACameraManager* manager, maq::ndk::ACameraIdList** list) {
    std::lock_guard<std::mutex> lock(self().mutex_);
    self().use(manager);
    if (const int error = self().fails("ACameraManager_getCameraIdList")) return Status(error);
    *list = self().make<maq::ndk::ACameraIdList>();
    (*list)->numCameras = int(self().cameras.size());
    (*list)->cameraIds = new const char*[self().cameras.size()];
    for (size_t i = 0; i < self().cameras.size(); ++i) (*list)->cameraIds[i] = self().cameras[i].id.c_str();
    return Status::ACAMERA_OK;
  }
  static void ACameraManager_deleteCameraIdList(maq::ndk::ACameraIdList* list) {
    delete[] list->cameraIds;
    self().end("ACameraIdList", list);
  }
  static Status ACameraManager_getCameraCharacteristics(maq::ndk::ACameraManager* manager, const char* id,
                                                        maq::ndk::ACameraMetadata** found) {
    std::lock_guard<std::mutex> lock(self().mutex_);
    self().use(manager);
    if (const int error = self().fails("ACameraManager_getCameraCharacteristics")) return Status(error);
    for (const FakeCamera& camera : self().cameras) {
      if (camera.id != id) continue;
      *found = self().make<maq::ndk::ACameraMetadata>();
      **found = camera.metadata;
      return Status::ACAMERA_OK;
    }
    return Status::ACAMERA_ERROR_INVALID_PARAMETER;
  }
  static Status ACameraManager_openCamera(maq::ndk::ACameraManager* manager, const char* id,
                                          maq::ndk::ACameraDevice_StateCallbacks* callbacks,
                                          maq::ndk::ACameraDevice** device) {
    std::lock_guard<std::mutex> lock(self().mutex_);
    self().use(manager);
    if (const int error = self().fails("ACameraManager_openCamera")) return Status(error);
    if (self().device_ != nullptr) return Status::ACAMERA_ERROR_CAMERA_IN_USE;
    *device = self().device_ = self().make<maq::ndk::ACameraDevice>();
    self().last_callbacks_ = (*device)->callbacks = *callbacks;
    self().opened_id_ = id;
    ++self().opened_;
    return Status::ACAMERA_OK;
  }
  static Status ACameraMetadata_getConstEntry(const maq::ndk::ACameraMetadata* metadata, uint32_t tag,
                                              maq::ndk::ACameraMetadata_const_entry* entry) {
    std::lock_guard<std::mutex> lock(self().mutex_);
    self().use(metadata);
    if (const int error = self().fails("ACameraMetadata_getConstEntry")) return Status(error);
    return metadata->get(tag, entry);
  }
  static void ACameraMetadata_free(maq::ndk::ACameraMetadata* metadata) { self().end("ACameraMetadata", metadata); }
  static Status ACameraDevice_close(maq::ndk::ACameraDevice* device) {
    int error = 0;
    {
      std::unique_lock<std::mutex> lock(self().mutex_);
      self().streaming_ = false;
      self().wait_for_callbacks(lock);
      self().device_ = nullptr;
      self().filled_reader_ = nullptr;
      error = self().fails("ACameraDevice_close");
    }
    self().end("ACameraDevice", device);  // also where it fails
    return Status(error);
  }
  static Status ACameraDevice_createCaptureRequest(const maq::ndk::ACameraDevice* device,
                                                   maq::ndk::ACameraDevice_request_template,
                                                   maq::ndk::ACaptureRequest** request) {
    std::lock_guard<std::mutex> lock(self().mutex_);
    self().use(device);
    if (const int error = self().fails("ACameraDevice_createCaptureRequest")) return Status(error);
    *request = self().make<maq::ndk::ACaptureRequest>();
    (*request)->settings.set<int32_t>(maq::ndk::ACAMERA_CONTROL_AE_TARGET_FPS_RANGE, {7, 30});
    return Status::ACAMERA_OK;
  }
  static Status ACameraDevice_createCaptureSession(maq::ndk::ACameraDevice* device,
                                                   const maq::ndk::ACaptureSessionOutputContainer* outputs,
                                                   const maq::ndk::ACameraCaptureSession_stateCallbacks* callbacks,
                                                   maq::ndk::ACameraCaptureSession** session) {
    std::lock_guard<std::mutex> lock(self().mutex_);
    self().use(device);
    self().use(outputs);
    if (callbacks == nullptr) self().note("createCaptureSession without callbacks");
    if (const int error = self().fails("ACameraDevice_createCaptureSession")) return Status(error);
    self().session_callbacks_ = *callbacks;
    self().filled_reader_ = self().reader_;
    *session = self().make<maq::ndk::ACameraCaptureSession>();
    return Status::ACAMERA_OK;
  }
  static Status ACaptureSessionOutputContainer_create(maq::ndk::ACaptureSessionOutputContainer** made) {
    return self().create("ACaptureSessionOutputContainer_create", made);
  }
  static Status ACaptureSessionOutputContainer_add(maq::ndk::ACaptureSessionOutputContainer* container,
                                                   const maq::ndk::ACaptureSessionOutput* output) {
    std::lock_guard<std::mutex> lock(self().mutex_);
    self().use(container);
    self().use(output);
    return Status(self().fails("ACaptureSessionOutputContainer_add"));
  }
  static void ACaptureSessionOutputContainer_free(maq::ndk::ACaptureSessionOutputContainer* container) {
    self().end("ACaptureSessionOutputContainer", container);
  }
  static Status ACaptureSessionOutput_create(maq::ndk::ANativeWindow* window, maq::ndk::ACaptureSessionOutput** made) {
    return self().create("ACaptureSessionOutput_create", made, window != nullptr);
  }
  static void ACaptureSessionOutput_free(maq::ndk::ACaptureSessionOutput* output) {
    self().end("ACaptureSessionOutput", output);
  }
  static Status ACameraOutputTarget_create(maq::ndk::ANativeWindow* window, maq::ndk::ACameraOutputTarget** made) {
    return self().create("ACameraOutputTarget_create", made, window != nullptr);
  }
  static void ACameraOutputTarget_free(maq::ndk::ACameraOutputTarget* target) {
    self().end("ACameraOutputTarget", target);
  }
  static Status ACaptureRequest_addTarget(maq::ndk::ACaptureRequest* request,
                                          const maq::ndk::ACameraOutputTarget* target) {
    std::lock_guard<std::mutex> lock(self().mutex_);
    self().use(request);
    self().use(target);
    return Status(self().fails("ACaptureRequest_addTarget"));
  }
  static Status ACaptureRequest_getConstEntry(const maq::ndk::ACaptureRequest* request, uint32_t tag,
                                              maq::ndk::ACameraMetadata_const_entry* entry) {
    std::lock_guard<std::mutex> lock(self().mutex_);
    self().use(request);
    if (const int error = self().fails("ACaptureRequest_getConstEntry")) return Status(error);
    return request->settings.get(tag, entry);
  }
  static Status ACaptureRequest_setEntry_i32(maq::ndk::ACaptureRequest* request, uint32_t tag, uint32_t count,
                                             const int32_t* values) {
    std::lock_guard<std::mutex> lock(self().mutex_);
    self().use(request);
    if (const int error = self().fails("ACaptureRequest_setEntry_i32")) return Status(error);
    request->settings.set<int32_t>(tag, {values, values + count});
    return Status::ACAMERA_OK;
  }
  static void ACaptureRequest_free(maq::ndk::ACaptureRequest* request) { self().end("ACaptureRequest", request); }
  static Status ACameraCaptureSession_setRepeatingRequest(maq::ndk::ACameraCaptureSession* session,
                                                          maq::ndk::ACameraCaptureSession_captureCallbacks* captures,
                                                          int count, maq::ndk::ACaptureRequest** requests, int*) {
    std::lock_guard<std::mutex> lock(self().mutex_);
    self().use(session);
    for (int i = 0; i < count; ++i) self().use(requests[i]);
    if (const int error = self().fails("ACameraCaptureSession_setRepeatingRequest")) return Status(error);
    maq::ndk::ACameraMetadata_const_entry entry{};
    requests[0]->settings.get(maq::ndk::ACAMERA_CONTROL_AE_TARGET_FPS_RANGE, &entry);
    self().rates_ = {entry.data.i32[0], entry.data.i32[1]};
    self().capture_callbacks_ = *captures;
    self().streaming_ = true;
    return Status::ACAMERA_OK;
  }
  static void ACameraCaptureSession_close(maq::ndk::ACameraCaptureSession* session) {
    self().session_callbacks_.onClosed(self().session_callbacks_.context, session);
    self().end("ACameraCaptureSession", session);
  }

  static MediaStatus AImageReader_new(int32_t width, int32_t height, int32_t format, int32_t max_images,
                                      maq::ndk::AImageReader** reader) {
    std::lock_guard<std::mutex> lock(self().mutex_);
    if (const int error = self().fails("AImageReader_new")) return MediaStatus(error);
    if (format != maq::ndk::AIMAGE_FORMAT_YUV_420_888) self().note("a reader of another format");
    *reader = self().reader_ = self().make<maq::ndk::AImageReader>();
    (*reader)->width = width;
    (*reader)->height = height;
    (*reader)->max_images = max_images;
    return MediaStatus::AMEDIA_OK;
  }
  static void AImageReader_delete(maq::ndk::AImageReader* reader) {
    {
      std::unique_lock<std::mutex> lock(self().mutex_);
      self().use(reader);
      if (reader->acquired != 0) self().note("the reader is deleted while an image is out");
      if (self().filled_reader_ == reader) self().note("the reader is deleted before the device is closed");
      self().wait_for_callbacks(lock);
      for (maq::ndk::AImage* image : reader->queue) {
        self().alive_.erase(image);
        delete image;
      }
      if (self().reader_ == reader) self().reader_ = nullptr;
    }
    self().end("AImageReader", reader);
  }
  static MediaStatus AImageReader_getWindow(maq::ndk::AImageReader* reader, maq::ndk::ANativeWindow** window) {
    std::lock_guard<std::mutex> lock(self().mutex_);
    self().use(reader);
    if (const int error = self().fails("AImageReader_getWindow")) return MediaStatus(error);
    *window = &reader->window;
    return MediaStatus::AMEDIA_OK;
  }
  static MediaStatus AImageReader_setImageListener(maq::ndk::AImageReader* reader,
                                                   maq::ndk::AImageReader_ImageListener* listener) {
    std::lock_guard<std::mutex> lock(self().mutex_);
    self().use(reader);
    if (const int error = self().fails("AImageReader_setImageListener")) return MediaStatus(error);
    self().last_listener_ = reader->listener = *listener;
    return MediaStatus::AMEDIA_OK;
  }
  static MediaStatus AImageReader_acquireNextImage(maq::ndk::AImageReader* reader, maq::ndk::AImage** image) {
    std::lock_guard<std::mutex> lock(self().mutex_);
    self().use(reader);
    *image = nullptr;
    if (const int error = self().fails("AImageReader_acquireNextImage")) {
      // As Android does with a buffer that does not fit: it goes back to the device.
      if (!reader->queue.empty()) {
        self().alive_.erase(reader->queue.front());
        delete reader->queue.front();
        reader->queue.pop_front();
      }
      return MediaStatus(error);
    }
    if (reader->queue.empty()) return MediaStatus::AMEDIA_IMGREADER_NO_BUFFER_AVAILABLE;
    *image = reader->queue.front();
    reader->queue.pop_front();
    ++reader->acquired;
    return MediaStatus::AMEDIA_OK;
  }
  static void AImage_delete(maq::ndk::AImage* image) {
    {
      std::lock_guard<std::mutex> lock(self().mutex_);
      self().use(image);
      self().use(image->reader);
      --image->reader->acquired;
    }
    self().end("AImage", image);
  }
  static MediaStatus AImage_getWidth(const maq::ndk::AImage* image, int32_t* width) {
    return self().get("AImage_getWidth", image, [&] { *width = image->width; });
  }
  static MediaStatus AImage_getHeight(const maq::ndk::AImage* image, int32_t* height) {
    return self().get("AImage_getHeight", image, [&] { *height = image->height; });
  }
  static MediaStatus AImage_getTimestamp(const maq::ndk::AImage* image, int64_t* timestamp_ns) {
    return self().get("AImage_getTimestamp", image, [&] { *timestamp_ns = image->timestamp_ns; });
  }
  static MediaStatus AImage_getPlaneData(const maq::ndk::AImage* image, int plane, uint8_t** data, int* bytes) {
    return self().get("AImage_getPlaneData", image, [&] {
      *data = image->has_null_plane ? nullptr : const_cast<uint8_t*>(image->memory.data()) + image->planes[plane].begin;
      *bytes = image->planes[plane].bytes;
    });
  }
  static MediaStatus AImage_getPlanePixelStride(const maq::ndk::AImage* image, int plane, int32_t* stride) {
    return self().get("AImage_getPlanePixelStride", image, [&] { *stride = image->planes[plane].pixel_stride; });
  }
  static MediaStatus AImage_getPlaneRowStride(const maq::ndk::AImage* image, int plane, int32_t* stride) {
    return self().get("AImage_getPlaneRowStride", image, [&] { *stride = image->planes[plane].row_stride; });
  }

 private:
  struct Fault {
    int error = 0;
    int after = 0;
    int times = 0;
  };

  // The functions of C know no object.
  static FakeCamera2*& current() {
    static FakeCamera2* fake = nullptr;
    return fake;
  }
  static FakeCamera2& self() { return *current(); }

  // The following with the mutex locked, but for end(), create(), get() and end_callback().
  int fails(const std::string& name) {
    const auto found = faults_.find(name);
    if (found == faults_.end() || found->second.after-- > 0 || found->second.times <= 0) return 0;
    --found->second.times;
    return found->second.error;
  }
  template <class Object>
  Object* make() {
    auto* made = new Object{};
    alive_.insert(made);
    return made;
  }
  void use(const void* object) {
    if (alive_.count(object) == 0) note("a function is called with an object that is freed, or null");
  }
  void note(const std::string& what) {
    if (misuse_.empty()) misuse_ = what;
  }
  void wait_for_callbacks(std::unique_lock<std::mutex>& lock) {
    ended_.wait(lock, [&] { return callbacks_ == 0; });
  }
  maq::ndk::ACameraCaptureSession_captureCallbacks begin_capture_callback() {
    std::lock_guard<std::mutex> lock(mutex_);
    ++callbacks_;
    return capture_callbacks_;
  }
  void end_callback() {
    std::lock_guard<std::mutex> lock(mutex_);
    --callbacks_;
    ended_.notify_all();
  }
  template <class Object>
  void end(const std::string& kind, Object* object) {
    std::lock_guard<std::mutex> lock(mutex_);
    if (alive_.erase(object) == 0) {
      note(kind + " is freed twice, or never was");
    } else {
      delete object;
    }
  }
  template <class Object>
  Status create(const std::string& name, Object** made, bool is_valid = true) {
    std::lock_guard<std::mutex> lock(mutex_);
    if (!is_valid) note(name + " without a window");
    if (const int error = fails(name)) return Status(error);
    *made = make<Object>();
    return Status::ACAMERA_OK;
  }
  template <class Read>
  MediaStatus get(const std::string& name, const maq::ndk::AImage* image, Read read) {
    std::lock_guard<std::mutex> lock(mutex_);
    use(image);
    if (const int error = fails(name)) return MediaStatus(error);
    read();
    return MediaStatus::AMEDIA_OK;
  }

  maq::ndk::AImage* make_image(uint8_t seed) {
    auto* image = make<maq::ndk::AImage>();
    image->reader = reader_;
    image->has_null_plane = has_null_plane;
    image->width = size ? size->first : reader_->width;
    image->height = size ? size->second : reader_->height;
    last_ns_ = std::max(last_ns_ + 1, maq::monotonic_ns());
    image->timestamp_ns = timestamp_ns.value_or(last_ns_);
    const int columns = (image->width + 1) / 2, rows = (image->height + 1) / 2;
    const int spacing = layout == Layout::kPlanar ? 1 : layout == Layout::kOdd ? 3 : 2;
    const bool is_shared = layout == Layout::kUv || layout == Layout::kVu;
    const auto plane = [&](int index, size_t begin, int pixels, int lines, int step, int row) {
      image->planes[index] = {begin, (lines - 1) * row + (pixels - 1) * step + 1, row, step};
      return begin + size_t(lines) * size_t(row);
    };
    size_t end = plane(0, 0, image->width, image->height, 1, image->width + padding);
    const int row = spacing * columns + padding;
    const size_t u_begin = end + (layout == Layout::kVu ? 1 : 0);
    const size_t v_begin =
        is_shared ? end + (layout == Layout::kUv ? 1 : 0) : plane(1, end, columns, rows, spacing, row);
    plane(1, u_begin, columns, rows, spacing, row);
    // An odd device has other lines in each plane.
    end = plane(2, v_begin, columns, rows, spacing, row + (layout == Layout::kOdd ? 5 : 0));
    image->memory.assign(end, 0xEE);
    for (int index = 0; index < 3; ++index) {
      const auto& to = image->planes[index];
      for (int y = 0; y < (index == 0 ? image->height : rows); ++y) {
        for (int x = 0; x < (index == 0 ? image->width : columns); ++x) {
          image->memory[to.begin + size_t(y) * size_t(to.row_stride) + size_t(x) * size_t(to.pixel_stride)] =
              index == 0 ? luma(x, y, seed) : chroma(index == 2, x, y, seed);
        }
      }
    }
    for (int index : {1, 2}) {
      image->planes[index].row_stride = row_stride.value_or(image->planes[index].row_stride);
      image->planes[index].pixel_stride = pixel_stride.value_or(image->planes[index].pixel_stride);
      image->planes[index].bytes -= missing_bytes;
    }
    return image;
  }

  mutable std::mutex mutex_;
  std::condition_variable ended_;
  std::map<std::string, Fault> faults_;
  std::set<const void*> alive_;
  std::string misuse_;
  int callbacks_ = 0;                                // that run now
  maq::ndk::AImageReader* reader_ = nullptr;         // the latest
  maq::ndk::AImageReader* filled_reader_ = nullptr;  // by the device
  maq::ndk::ACameraDevice* device_ = nullptr;
  maq::ndk::AImageReader_ImageListener last_listener_{};
  maq::ndk::ACameraDevice_StateCallbacks last_callbacks_{};
  maq::ndk::ACameraCaptureSession_stateCallbacks session_callbacks_{};
  maq::ndk::ACameraCaptureSession_captureCallbacks capture_callbacks_{};
  bool streaming_ = false;
  int opened_ = 0;
  std::string opened_id_;
  std::pair<int, int> rates_;
  int64_t last_ns_ = 0;
};
