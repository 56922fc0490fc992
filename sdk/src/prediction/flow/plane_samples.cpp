#include "prediction/flow/plane_samples.h"

#include "core/rounding.h"

namespace maq {

int plane_samples(const ImageView& image, uint8_t* pixels, PlaneSamples* all) {
  const ImageView packed = packed_view(image.format, image.width_px, image.height_px, pixels);
  const auto plane = [&](int index, size_t offset, int channels, int channel_bytes, int pixel_bytes, int by_x,
                         int by_y) {
    const size_t begin = size_t(packed.planes[index].data - pixels) + offset;
    return PlaneSamples{image.planes[index].data + offset,
                        image.planes[index].stride_bytes,
                        pixels + begin,
                        packed.planes[index].stride_bytes,
                        divide_up(image.width_px, by_x),
                        divide_up(image.height_px, by_y),
                        channels,
                        channel_bytes,
                        pixel_bytes,
                        by_x,
                        by_y};
  };
  switch (image.format) {
    case MAQ_PIXEL_NV12:
      all[0] = plane(0, 0, 1, 1, 1, 1, 1);
      all[1] = plane(1, 0, 2, 1, 2, 2, 2);
      return 2;
    case MAQ_PIXEL_YUYV:
      all[0] = plane(0, 0, 1, 1, 2, 1, 1);
      all[1] = plane(0, 1, 2, 2, 4, 2, 1);
      return 2;
    default: {
      const int bytes = int(row_bytes(image.format, 0, 1));
      all[0] = plane(0, 0, bytes, 1, bytes, 1, 1);
      return 1;
    }
  }
}

}  // namespace maq
