#include "sources/libcamera/formats.h"

#include <libcamera/color_space.h>
#include <libcamera/formats.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "sources/camera_errors.h"

namespace maq {
namespace {

namespace formats = libcamera::formats;

// The cheapest to use first. libcamera names formats of whole pixels from the highest byte of a little-endian number to
// the lowest: its RGB888 is B, G, R in memory.
struct KnownFormat {
  libcamera::PixelFormat format;
  maq_pixel_format pixels;
  bool jpeg;
};
constexpr KnownFormat kKnownFormats[] = {
    {formats::NV12, MAQ_PIXEL_NV12, false},      {formats::YUYV, MAQ_PIXEL_YUYV, false},
    {formats::RGB888, MAQ_PIXEL_BGR8, false},    {formats::BGR888, MAQ_PIXEL_RGB8, false},
    {formats::XBGR8888, MAQ_PIXEL_RGBA8, false}, {formats::ABGR8888, MAQ_PIXEL_RGBA8, false},
    {formats::R8, MAQ_PIXEL_GREY8, false},       {formats::MJPEG, MAQ_PIXEL_BGR8, true},
};

const KnownFormat* known_format(const libcamera::PixelFormat& format) {
  for (const KnownFormat& known : kKnownFormats) {
    if (known.format == format) return &known;
  }
  return nullptr;
}

// "MJPG", "RG24", "R8": without spaces at their end.
std::string four_letters(const libcamera::PixelFormat& format) {
  std::string letters;
  for (int shift = 0; shift < 32; shift += 8) letters += char(format.fourcc() >> shift);
  return letters.substr(0, letters.find_last_not_of(' ') + 1);
}

double size_error(const libcamera::Size& size, const libcamera::Size& wanted) {
  return std::abs(std::log(double(std::max(size.width, 1u)) / wanted.width)) +
         std::abs(std::log(double(std::max(size.height, 1u)) / wanted.height));
}

// False when the camera takes another format instead, or nothing.
bool propose(libcamera::CameraConfiguration& configuration, const KnownFormat& known, const libcamera::Size& size,
             int buffers) {
  libcamera::StreamConfiguration& stream = configuration.at(0);
  stream.pixelFormat = known.format;
  stream.size = size;
  stream.stride = 0;
  stream.frameSize = 0;
  stream.bufferCount = unsigned(buffers);
  stream.colorSpace.reset();
  const bool is_yuv = known.pixels == MAQ_PIXEL_NV12 || known.pixels == MAQ_PIXEL_YUYV;
  if (is_yuv) stream.colorSpace = libcamera::ColorSpace::Smpte170m;  // BT.601 in video range, as frames promise
  return configuration.validate() != libcamera::CameraConfiguration::Invalid && stream.pixelFormat == known.format;
}

}  // namespace

std::unique_ptr<libcamera::CameraConfiguration> libcamera_configuration(libcamera::Camera& camera,
                                                                        const std::string& label) {
  auto configuration = camera.generateConfiguration({libcamera::StreamRole::Viewfinder});
  if (configuration == nullptr || configuration->empty()) refuse_camera(label, "offers no stream of images");
  return configuration;
}

std::vector<CameraMode> libcamera_modes(const libcamera::CameraConfiguration& configuration) {
  std::vector<CameraMode> modes;
  const libcamera::StreamFormats& offered = configuration.at(0).formats();
  for (const libcamera::PixelFormat& format : offered.pixelformats()) {
    for (const libcamera::Size& size : offered.sizes(format)) {
      modes.push_back({four_letters(format), known_format(format) != nullptr, int(size.width), int(size.height), 0});
    }
  }
  return modes;
}

void choose_libcamera_format(libcamera::CameraConfiguration& configuration, const CameraRequest& request, int buffers,
                             const std::string& label) {
  const libcamera::Size wanted(request.width_px > 0 ? unsigned(request.width_px) : unsigned(kDefaultCameraWidthPx),
                               request.height_px > 0 ? unsigned(request.height_px) : unsigned(kDefaultCameraHeightPx));
  const libcamera::StreamConfiguration& stream = configuration.at(0);
  const libcamera::StreamFormats offered = stream.formats();
  const std::vector<libcamera::PixelFormat> pixel_formats = offered.pixelformats();
  struct Choice {
    double error;
    const KnownFormat* known;
    libcamera::Size size;
  };
  std::optional<Choice> best;
  for (const KnownFormat& known : kKnownFormats) {
    if (std::find(pixel_formats.begin(), pixel_formats.end(), known.format) == pixel_formats.end()) continue;
    if (!request.format.empty() && request.format != four_letters(known.format) &&
        request.format != known.format.toString()) {
      continue;
    }
    // The size that was asked for, and the nearest of the list: some cameras take any size, some the next smaller of
    // the list.
    std::vector<libcamera::Size> sizes = offered.sizes(known.format);
    const auto nearest = std::min_element(sizes.begin(), sizes.end(), [&](const auto& a, const auto& b) {
      return size_error(a, wanted) < size_error(b, wanted);
    });
    for (const libcamera::Size& size : {wanted, nearest == sizes.end() ? wanted : *nearest}) {
      if (!propose(configuration, known, size, buffers)) continue;
      const double error = size_error(stream.size, wanted);
      if (!best || error < best->error) best = Choice{error, &known, stream.size};
    }
  }
  if (!best) {
    std::string names;
    for (const libcamera::PixelFormat& format : pixel_formats) {
      names += (names.empty() ? "" : ", ") + four_letters(format);
    }
    refuse_camera(label, concatenate("offers ", names.empty() ? "no format" : names, ", but ",
                                     request.format.empty() ? "none of them is understood" : "not " + request.format));
  }
  if (!propose(configuration, *best->known, best->size, buffers)) refuse_camera(label, "does not take its own format");
}

LibcameraFormat agreed_libcamera_format(const libcamera::StreamConfiguration& agreed, const std::string& label) {
  const KnownFormat* known = known_format(agreed.pixelFormat);
  const uint64_t width = agreed.size.width, height = agreed.size.height;
  if (known == nullptr || agreed.stream() == nullptr || width < 1 || height < 1 || width > MAQ_MAX_SIDE_PX ||
      height > MAQ_MAX_SIDE_PX || width * height > MAQ_MAX_PIXELS) {
    refuse_camera(label, concatenate("answered with a format that cannot be used (", width, " x ", height, ")"));
  }
  LibcameraFormat found;
  found.format.pixels = known->pixels;
  found.format.jpeg = known->jpeg;
  found.format.width_px = int(width);
  found.format.height_px = int(height);
  if (known->jpeg) return found;
  const size_t row = row_bytes(known->pixels, 0, found.format.width_px);
  found.stride_bytes = agreed.stride == 0 ? row : agreed.stride;
  if (found.stride_bytes < row || found.stride_bytes > 16 * row) {
    refuse_camera(label, concatenate("answered with lines of ", found.stride_bytes, " bytes for ", width, " pixels"));
  }
  return found;
}

}  // namespace maq
