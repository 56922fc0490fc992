#include "image/yuv_planes.h"

#include <algorithm>

#include "core/error.h"
#include "core/frame.h"

namespace maq {
namespace {

// In 16 bits behind the point, rounded: 219 / 255 and 224 / 255.
constexpr uint32_t kLumaScale = 56284, kChromaScale = 57569, kHalfStep = 1 << 15;

// In place, of the full range in the video range.
void scale_to_video(uint8_t* values, size_t count, uint32_t scale) {
  for (size_t i = 0; i < count; ++i) values[i] = uint8_t(16 + ((values[i] * scale + kHalfStep) >> 16));
}

// kStride 0: the stride that is given.
template <int kStride>
void interleave_row(const uint8_t* u, const uint8_t* v, int u_stride, int v_stride, int count, uint8_t* uv) {
  for (int x = 0; x < count; ++x) {
    uv[2 * x] = u[x * (kStride == 0 ? u_stride : kStride)];
    uv[2 * x + 1] = v[x * (kStride == 0 ? v_stride : kStride)];
  }
}

}  // namespace

std::optional<std::string> yuv_image_problem(const YuvImage& image) {
  try {
    check_image_size(image.width_px, image.height_px, "the image");
  } catch (const Error& error) {
    return error.what();
  }
  for (int index = 0; index < 3; ++index) {
    const YuvPlane& plane = image.planes[index];
    const int64_t columns = index == 0 ? image.width_px : (image.width_px + 1) / 2;
    const int64_t rows = index == 0 ? image.height_px : (image.height_px + 1) / 2;
    const int64_t row_bytes = (columns - 1) * plane.pixel_stride + 1;
    const bool is_spaced = index == 0 ? plane.pixel_stride == 1 : plane.pixel_stride >= 1;
    const std::string what =
        concatenate("plane ", "YUV"[index], " of an image of ", image.width_px, " x ", image.height_px, " pixels ");
    if (plane.data == nullptr) return what + "has no memory";
    if (!is_spaced || plane.row_stride < row_bytes) {
      return concatenate(what, "cannot have rows ", plane.row_stride, " bytes apart and pixels ", plane.pixel_stride,
                         " bytes apart");
    }
    const int64_t needed = (rows - 1) * plane.row_stride + row_bytes;
    if (uint64_t(needed) > plane.bytes) return concatenate(what, "needs ", needed, " bytes, but has ", plane.bytes);
  }
  return {};
}

namespace {

void upright_to_nv12(const YuvImage& image, uint8_t* nv12) {
  const YuvPlane &luma = image.planes[0], &u = image.planes[1], &v = image.planes[2];
  for (int y = 0; y < image.height_px; ++y) {
    const uint8_t* from = luma.data + ptrdiff_t(y) * luma.row_stride;
    nv12 = std::copy_n(from, image.width_px, nv12);
  }
  const int columns = (image.width_px + 1) / 2;
  const bool is_same = u.pixel_stride == v.pixel_stride;
  const auto interleave = is_same && u.pixel_stride == 1   ? interleave_row<1>
                          : is_same && u.pixel_stride == 2 ? interleave_row<2>
                                                           : interleave_row<0>;
  for (int y = 0; y < (image.height_px + 1) / 2; ++y) {
    interleave(u.data + ptrdiff_t(y) * u.row_stride, v.data + ptrdiff_t(y) * v.row_stride, u.pixel_stride,
               v.pixel_stride, columns, nv12);
    nv12 += ptrdiff_t(2) * columns;
  }
}

// Reads a plane in the order of the rotated image.
struct RotatedPlane {
  const uint8_t* first;
  ptrdiff_t across, down;
  int columns, rows;
};

RotatedPlane rotated(const YuvPlane& plane, int columns, int rows, int quarter_turns) {
  const ptrdiff_t column = plane.pixel_stride, row = plane.row_stride;
  const uint8_t* const bottom = plane.data + (rows - 1) * row;
  switch (quarter_turns) {
    case 1: return {bottom, -row, column, rows, columns};
    case 2: return {bottom + (columns - 1) * column, -column, -row, columns, rows};
    default: return {plane.data + (columns - 1) * column, row, -column, rows, columns};
  }
}

// Writes a value in each `spacing` bytes, in tiles, so that rows of the image stay in the cache.
void write_rotated(const RotatedPlane& plane, int spacing, uint8_t* to) {
  constexpr int kTile = 32;
  for (int y0 = 0; y0 < plane.rows; y0 += kTile) {
    for (int x0 = 0; x0 < plane.columns; x0 += kTile) {
      for (int y = y0; y < std::min(y0 + kTile, plane.rows); ++y) {
        const uint8_t* from = plane.first + y * plane.down + x0 * plane.across;
        uint8_t* pixel = to + (ptrdiff_t(y) * plane.columns + x0) * spacing;
        for (int x = x0; x < std::min(x0 + kTile, plane.columns); ++x, from += plane.across, pixel += spacing) {
          *pixel = *from;
        }
      }
    }
  }
}

}  // namespace

void yuv_to_nv12(const YuvImage& image, int quarter_turns, uint8_t* nv12) {
  const size_t luma = size_t(image.width_px) * size_t(image.height_px);
  const int columns = (image.width_px + 1) / 2, rows = (image.height_px + 1) / 2;
  if (quarter_turns == 0) {
    upright_to_nv12(image, nv12);
  } else {
    write_rotated(rotated(image.planes[0], image.width_px, image.height_px, quarter_turns), 1, nv12);
    for (int index = 1; index < 3; ++index) {
      write_rotated(rotated(image.planes[index], columns, rows, quarter_turns), 2, nv12 + luma + index - 1);
    }
  }
  if (!image.is_full_range) return;
  scale_to_video(nv12, luma, kLumaScale);
  scale_to_video(nv12 + luma, 2 * size_t(columns) * size_t(rows), kChromaScale);
}

}  // namespace maq
