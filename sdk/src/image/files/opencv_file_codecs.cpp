#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <opencv2/videoio/registry.hpp>

#include "core/module.h"
#include "image/files/file_codecs.h"

namespace maq {
namespace {

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
  bool read(cv::Mat& image) override {
    try {
      return clip_.read(image) && !image.empty();
    } catch (const std::exception&) {
      return false;
    }
  }

 private:
  cv::VideoCapture clip_;
};

class OpenCvClipEncoder : public ClipEncoder {
 public:
  ~OpenCvClipEncoder() override {
    try {
      file_.release();
    } catch (const std::exception&) {
    }
  }
  bool open(const std::string& path, ClipFormat format, double fps, cv::Size size) {
    if (format == ClipFormat::kMpeg4) {
      return file_.open(path, cv::CAP_FFMPEG, cv::VideoWriter::fourcc('m', 'p', '4', 'v'), fps, size);
    }
    const int fourcc = cv::VideoWriter::fourcc('M', 'J', 'P', 'G');
    // OpenCV's own, where there is no FFmpeg or one without that.
    return file_.open(path, cv::CAP_FFMPEG, fourcc, fps, size) ||
           file_.open(path, cv::CAP_OPENCV_MJPEG, fourcc, fps, size);
  }
  bool write(const cv::Mat& image) override {
    try {
      file_.write(image);
      return true;
    } catch (const std::exception&) {
      return false;
    }
  }

 private:
  cv::VideoWriter file_;
};

class OpenCvFileCodecs : public FileCodecs {
 public:
  // OpenCV throws for some damaged files and returns an empty image for others.
  cv::Mat decode_image(const uint8_t* bytes, size_t size_bytes, Orientation orientation) const override {
    try {
      const cv::Mat encoded(1, int(size_bytes), CV_8UC1, const_cast<uint8_t*>(bytes));
      return cv::imdecode(encoded, orientation == Orientation::kUpright
                                       ? cv::IMREAD_COLOR
                                       : int(cv::IMREAD_COLOR) | int(cv::IMREAD_IGNORE_ORIENTATION));
    } catch (const std::exception&) {
      return {};
    }
  }

  bool encode_image(const std::string& ending, const cv::Mat& image, std::vector<uint8_t>& bytes) const override {
    try {
      return cv::imencode(ending, image, bytes);
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

  std::unique_ptr<ClipEncoder> begin_clip(const std::string& path, ClipFormat format, double fps,
                                          cv::Size size) const override {
    try {
      auto clip = std::make_unique<OpenCvClipEncoder>();
      if (clip->open(path, format, fps, size)) return clip;
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
