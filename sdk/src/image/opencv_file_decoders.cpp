#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <opencv2/videoio/registry.hpp>

#include "core/module.h"
#include "image/file_decoders.h"

namespace maq {
namespace {

class OpenCvClip : public Clip {
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

class OpenCvFileDecoders : public FileDecoders {
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

  std::unique_ptr<Clip> open_clip(const std::string& path) const override {
    try {
      auto clip = std::make_unique<OpenCvClip>();
      if (clip->open(path)) return clip;
    } catch (const std::exception&) {
    }
    return nullptr;
  }
};

}  // namespace
}  // namespace maq

#ifdef MAQ_MODULE_VERSION
extern "C" __attribute__((visibility("default"))) maq::ModuleExport maquette_file_decoders() {
  static maq::OpenCvFileDecoders decoders;
  return {MAQ_MODULE_VERSION, static_cast<maq::FileDecoders*>(&decoders)};
}
#else
namespace maq {
const FileDecoders& file_decoders() {
  static const OpenCvFileDecoders decoders;
  return decoders;
}
}  // namespace maq
#endif
