#include <dlfcn.h>

#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <opencv2/videoio/registry.hpp>

#include <atomic>
#include <cstdarg>
#include <iostream>
#include <mutex>
#include <streambuf>

#include "core/module.h"
#include "image/files/file_codecs.h"
#include "image/files/png.h"

namespace maq {
namespace {

// The library never prints, but OpenCV writes complaints about a file to stderr. Its log level belongs to the process:
// while an object of this class is alive it is the lowest, and afterwards the app's level.
class OpenCvSilence {
 public:
  OpenCvSilence() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (users_++ == 0) level_ = cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  }
  ~OpenCvSilence() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (--users_ == 0) cv::utils::logging::setLogLevel(level_);
  }
  OpenCvSilence(const OpenCvSilence&) = delete;
  OpenCvSilence& operator=(const OpenCvSilence&) = delete;

 private:
  static inline std::mutex mutex_;
  static inline int users_ = 0;
  static inline cv::utils::logging::LogLevel level_ = cv::utils::logging::LOG_LEVEL_SILENT;
};

// FFmpeg tells stderr too, on threads of its own, and OpenCV sets its level anew whenever it opens a clip. So the log
// callback of the process is replaced: while an object of this class is alive nothing is printed, afterwards FFmpeg's
// own callback is back. There is no function that returns the callback before: this one is set once, so that an app's,
// set later, stays.
class FfmpegSilence {
 public:
  FfmpegSilence() {
    [[maybe_unused]] static const bool is_set = replace_callback();
    ++users_;
  }
  ~FfmpegSilence() { --users_; }
  FfmpegSilence(const FfmpegSilence&) = delete;
  FfmpegSilence& operator=(const FfmpegSilence&) = delete;

 private:
  using Callback = void (*)(void* object, int level, const char* format, va_list arguments);

  static bool replace_callback() {
    default_ = reinterpret_cast<Callback>(find("av_log_default_callback"));
    const auto set_callback = reinterpret_cast<void (*)(Callback)>(find("av_log_set_callback"));
    if (default_ != nullptr && set_callback != nullptr) set_callback(log);
    return true;
  }
  static void log(void* object, int level, const char* format, va_list arguments) {
    if (users_ == 0) default_(object, level, format, arguments);
  }
  // FFmpeg comes with OpenCV, without headers: its functions are looked up in this module's dependencies.
  static void* find(const char* function) {
    Dl_info info{};
    static const int here = 0;
    dladdr(&here, &info);
    void* module = dlopen(info.dli_fname, RTLD_LAZY | RTLD_NOLOAD);
    return dlsym(module == nullptr ? RTLD_DEFAULT : module, function);  // null: in the program itself, as in tests
  }

  static inline std::atomic<int> users_ = 0;
  static inline Callback default_ = nullptr;
};

// imdecode() writes the exceptions that it catches to std::cerr at any log level. Output of other threads passes
// through.
class ErrorStreamGate : public std::streambuf {
 public:
  // Closes the gate for this thread, until it is destroyed.
  class Closed {
   public:
    Closed() {
      static std::once_flag flag;
      std::call_once(flag, [] { std::cerr.rdbuf(new ErrorStreamGate(std::cerr.rdbuf())); });  // stays, as cerr does
      is_closed_ = true;
    }
    ~Closed() { is_closed_ = false; }
    Closed(const Closed&) = delete;
    Closed& operator=(const Closed&) = delete;
  };

 protected:
  int_type overflow(int_type character) override {
    if (is_closed_ || traits_type::eq_int_type(character, traits_type::eof())) return traits_type::not_eof(character);
    return target_ == nullptr ? traits_type::eof() : target_->sputc(traits_type::to_char_type(character));
  }
  std::streamsize xsputn(const char* text, std::streamsize count) override {
    if (is_closed_) return count;
    return target_ == nullptr ? 0 : target_->sputn(text, count);
  }
  int sync() override { return is_closed_ || target_ == nullptr ? 0 : target_->pubsync(); }

 private:
  explicit ErrorStreamGate(std::streambuf* target) : target_(target) {}

  static inline thread_local bool is_closed_ = false;
  std::streambuf* const target_;
};

cv::Mat as_mat(const ImageView& image) {
  return cv::Mat(image.height_px, image.width_px, image.format == MAQ_PIXEL_GREY8 ? CV_8UC1 : CV_8UC3,
                 const_cast<uint8_t*>(image.planes[0].data), image.planes[0].stride_bytes);
}

// Without pixels where it is neither BGR nor grey, of 8 bits.
ImageView as_view(const cv::Mat& image) {
  if (image.type() != CV_8UC3 && image.type() != CV_8UC1) return {MAQ_PIXEL_BGR8, image.cols, image.rows, {}};
  const maq_pixel_format format = image.type() == CV_8UC3 ? MAQ_PIXEL_BGR8 : MAQ_PIXEL_GREY8;
  return {format, image.cols, image.rows, {{image.data, image.step}, {}}};
}

class OpenCvClipDecoder : public ClipDecoder {
 public:
  bool open(const std::string& path) {
    // FFmpeg alone where it is there: the other backends of CAP_ANY add nothing for files but their complaints.
    return clip_.open(path, cv::videoio_registry::hasBackend(cv::CAP_FFMPEG) ? cv::CAP_FFMPEG : cv::CAP_ANY);
  }
  int width_px() const override { return int(clip_.get(cv::CAP_PROP_FRAME_WIDTH)); }
  int height_px() const override { return int(clip_.get(cv::CAP_PROP_FRAME_HEIGHT)); }
  double fps() const override { return clip_.get(cv::CAP_PROP_FPS); }
  double frame_count() const override { return clip_.get(cv::CAP_PROP_FRAME_COUNT); }
  double position_ms() const override { return clip_.get(cv::CAP_PROP_POS_MSEC); }
  double frame_number() const override { return clip_.get(cv::CAP_PROP_POS_FRAMES) - 1; }
  bool seek_ms(double time_ms) override {
    try {
      return clip_.set(cv::CAP_PROP_POS_MSEC, time_ms);
    } catch (const std::exception&) {
      return false;
    }
  }
  bool read(ImageView& image) override {
    try {
      if (!clip_.read(decoded_) || decoded_.empty()) return false;
      image = as_view(decoded_);
      return true;
    } catch (const std::exception&) {
      return false;
    }
  }

 private:
  OpenCvSilence opencv_silence_;
  FfmpegSilence ffmpeg_silence_;
  cv::VideoCapture clip_;
  cv::Mat decoded_;
};

class OpenCvClipEncoder : public ClipEncoder {
 public:
  ~OpenCvClipEncoder() override {
    try {
      file_.release();
    } catch (const std::exception&) {
    }
  }
  bool open(const std::string& path, ClipFormat format, double fps, int width_px, int height_px) {
    const cv::Size size(width_px, height_px);
    if (format == ClipFormat::kMpeg4) {
      return file_.open(path, cv::CAP_FFMPEG, cv::VideoWriter::fourcc('m', 'p', '4', 'v'), fps, size);
    }
    const int fourcc = cv::VideoWriter::fourcc('M', 'J', 'P', 'G');
    // OpenCV's own, where there is no FFmpeg or one without that.
    return file_.open(path, cv::CAP_FFMPEG, fourcc, fps, size) ||
           file_.open(path, cv::CAP_OPENCV_MJPEG, fourcc, fps, size);
  }
  bool write(const ImageView& image) override {
    try {
      file_.write(as_mat(image));
      return true;
    } catch (const std::exception&) {
      return false;
    }
  }

 private:
  OpenCvSilence opencv_silence_;
  FfmpegSilence ffmpeg_silence_;
  cv::VideoWriter file_;
};

class OpenCvFileCodecs : public FileCodecs {
 public:
  // OpenCV throws for some damaged files and returns an empty image for others.
  DecodedImage decode_image(const EncodedBytes& bytes, ImageFormat format) const override {
    try {
      if (format == ImageFormat::kPng) return decode_png(bytes.data, bytes.size);
      const OpenCvSilence silence;
      const ErrorStreamGate::Closed closed;
      const cv::Mat encoded(1, int(bytes.size), CV_8UC1, const_cast<uint8_t*>(bytes.data));
      const auto image =
          std::make_shared<cv::Mat>(cv::imdecode(encoded, int(cv::IMREAD_COLOR) | int(cv::IMREAD_IGNORE_ORIENTATION)));
      if (image->empty()) return {};
      return {as_view(*image), image};
    } catch (const std::exception&) {
      return {};
    }
  }

  bool encode_image(const std::string& extension, const ImageView& image, std::vector<uint8_t>& bytes) const override {
    try {
      if (image.format != MAQ_PIXEL_RGBA8) return cv::imencode(extension, as_mat(image), bytes);
      const cv::Mat rgba(image.height_px, image.width_px, CV_8UC4, const_cast<uint8_t*>(image.planes[0].data),
                         image.planes[0].stride_bytes);
      cv::Mat bgra(rgba.size(), CV_8UC4);
      cv::mixChannels({rgba}, {bgra}, {0, 2, 1, 1, 2, 0, 3, 3});
      return cv::imencode(extension, bgra, bytes);
    } catch (const std::exception&) {
      return false;
    }
  }

  DecodedImage decode_depth(const EncodedBytes& bytes, ImageFormat format) const override {
    try {
      if (format == ImageFormat::kPng) return decode_depth_png(bytes.data, bytes.size);
      const OpenCvSilence silence;
      const ErrorStreamGate::Closed closed;
      const cv::Mat encoded(1, int(bytes.size), CV_8UC1, const_cast<uint8_t*>(bytes.data));
      const auto image = std::make_shared<cv::Mat>(cv::imdecode(encoded, int(cv::IMREAD_UNCHANGED)));
      const bool is_float = image->type() == CV_32FC1;
      ImageView view{is_float ? MAQ_PIXEL_DEPTH32F : MAQ_PIXEL_DEPTH16, image->cols, image->rows, {}};
      if (is_float || image->type() == CV_16UC1) view.planes[0] = {image->data, image->step};
      return {view, image};
    } catch (const std::exception&) {
      return {};
    }
  }

  bool encode_depth(const std::string& extension, const ImageView& image, std::vector<uint8_t>& bytes) const override {
    try {
      const cv::Mat depth(image.height_px, image.width_px, image.format == MAQ_PIXEL_DEPTH16 ? CV_16UC1 : CV_32FC1,
                          const_cast<uint8_t*>(image.planes[0].data), image.planes[0].stride_bytes);
      return cv::imencode(extension, depth, bytes);
    } catch (const std::exception&) {
      return false;
    }
  }

  std::unique_ptr<ClipDecoder> open_clip(const std::string& path) const override {
    try {
      auto clip = std::make_unique<OpenCvClipDecoder>();
      if (clip->open(path)) return clip;
    } catch (const std::exception&) {
    }
    return nullptr;
  }

  std::unique_ptr<ClipEncoder> begin_clip(const std::string& path, ClipFormat format, double fps, int width_px,
                                          int height_px) const override {
    try {
      auto clip = std::make_unique<OpenCvClipEncoder>();
      if (clip->open(path, format, fps, width_px, height_px)) return clip;
    } catch (const std::exception&) {
    }
    return nullptr;
  }
};

}  // namespace
}  // namespace maq

#ifdef MAQ_MODULE_VERSION
extern "C" __attribute__((visibility("default"))) maq::ModuleExport maquette_file_codecs() {
  static maq::OpenCvFileCodecs codecs;
  return {MAQ_MODULE_VERSION, static_cast<maq::FileCodecs*>(&codecs)};
}
#else
namespace maq {
const FileCodecs& file_codecs() {
  static const OpenCvFileCodecs codecs;
  return codecs;
}
}  // namespace maq
#endif
