#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <opencv2/videoio/registry.hpp>

#include "core/module.h"
#include "image/files/file_codecs.h"

namespace maq {
namespace {

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
  cv::VideoWriter file_;
};

class OpenCvFileCodecs : public FileCodecs {
 public:
  // OpenCV throws for some damaged files and returns an empty image for others.
  DecodedImage decode_image(const uint8_t* bytes, size_t size_bytes, Orientation orientation) const override {
    try {
      const cv::Mat encoded(1, int(size_bytes), CV_8UC1, const_cast<uint8_t*>(bytes));
      const int flags = orientation == Orientation::kUpright
                            ? int(cv::IMREAD_COLOR)
                            : int(cv::IMREAD_COLOR) | int(cv::IMREAD_IGNORE_ORIENTATION);
      const auto image = std::make_shared<cv::Mat>(cv::imdecode(encoded, flags));
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
