#include "prediction/flow/luma_pyramid.h"

#include <algorithm>

#include "core/error.h"
#include "core/rounding.h"

namespace maq {
namespace {

constexpr const char* kNoPicture = "A depth image has no colours that could be predicted; give the picture.";

constexpr int kGreyRowsOfTask = 16;

// Where a format has its brightness: the bytes from a pixel to the next, and the weights (of 256) of its first three.
struct Brightness {
  int pixel_bytes;
  int weights[3];
};

Brightness brightness_of(maq_pixel_format format) {
  switch (format) {
    case MAQ_PIXEL_BGR8: return {3, {29, 150, 77}};
    case MAQ_PIXEL_RGB8: return {3, {77, 150, 29}};
    case MAQ_PIXEL_RGBA8: return {4, {77, 150, 29}};
    case MAQ_PIXEL_GREY8:
    case MAQ_PIXEL_NV12: return {1, {256, 0, 0}};
    default: return {2, {256, 0, 0}};  // YUYV
  }
}

// Adds a row of the frame, as 256 times its brightness, to the sums of columns.
void add_grey(const uint8_t* __restrict row, int width, int* __restrict sums) {
  for (int x = 0; x < width; ++x) sums[x] += row[x] * 256;
}

void add_brightness(const uint8_t* __restrict row, int width, const Brightness& as, int* __restrict sums) {
  if (as.pixel_bytes == 1) return add_grey(row, width, sums);
  // The second of two bytes a pixel has the weight 0, and the byte behind the last pixel is not read.
  const int first = as.weights[0], second = as.weights[1], third = as.weights[2];
  const size_t step = size_t(as.pixel_bytes), last = step == 2 ? 1 : 2;
  for (int x = 0; x < width; ++x, row += step) sums[x] += row[0] * first + row[1] * second + row[last] * third;
}

// Means of `scale` sums each, of which the last may be of fewer.
void mean_of_columns(const int* sums, int width, int scale, int rows, float* means) {
  const float factor = 1.0f / float(256 * scale * rows);
  int x = 0;
  if (scale == 1) {
    for (; x < width; ++x) means[x] = float(sums[x]) * factor;
    return;
  }
  for (; (x + 1) * scale <= width; ++x) {
    int sum = 0;
    for (int i = 0; i < scale; ++i) sum += sums[x * scale + i];
    means[x] = float(sum) * factor;
  }
  if (x * scale == width) return;
  int sum = 0;
  for (int i = x * scale; i < width; ++i) sum += sums[i];
  means[x] = float(sum) / float(256 * (width - x * scale) * rows);
}

// (1, 2, 1) / 4 both ways: noise and detail between pixels would look like motion.
void smooth_row(const float* __restrict above, const float* __restrict here, const float* __restrict below, int width,
                float* __restrict columns, float* __restrict smooth) {
  for (int x = 0; x < width; ++x) columns[x + 1] = (above[x] + here[x] + (here[x] + below[x])) * 0.25f;
  columns[0] = columns[1];
  columns[width + 1] = columns[width];
  for (int x = 0; x < width; ++x) {
    smooth[x] = (columns[x] + columns[x + 1] + (columns[x + 1] + columns[x + 2])) * 0.25f;
  }
}

void halve_row(const float* __restrict above, const float* __restrict below, int width, float* __restrict half) {
  for (int x = 0; x < width; ++x)
    half[x] = (above[2 * x] + above[2 * x + 1] + (below[2 * x] + below[2 * x + 1])) * 0.25f;
}

void repeat_ends(LumaLevel& level, int y) {
  constexpr int kBorder_px = LumaLevel::kBorder_px;
  float* const row = level.at(0, y);
  std::fill(row - kBorder_px, row, row[0]);
  std::fill(row + level.width_px, row + level.width_px + kBorder_px, row[level.width_px - 1]);
}

void repeat_first_and_last_row(LumaLevel& level) {
  constexpr int kBorder_px = LumaLevel::kBorder_px;
  const size_t stride = level.stride();
  for (const auto& [from, begin] : {std::pair{0, -kBorder_px}, {level.height_px - 1, level.height_px}}) {
    const float* const row = level.at(-kBorder_px, from);
    for (int y = begin; y < begin + kBorder_px; ++y) std::copy(row, row + stride, level.at(-kBorder_px, y));
  }
}

}  // namespace

void require_no_depth(const ImageView& image) {
  if (is_depth(image.format)) {
    throw Error(MAQ_ERROR_UNSUPPORTED, kNoPicture);
  }
}

void LumaLevel::resize(int width, int height) {
  width_px = width;
  height_px = height;
  memory.resize(stride() * size_t(height + 2 * kBorder_px));
}

void LumaPyramid::resize(int width, int height) {
  count_ = 1;
  for (int side = divide_up(std::min(width, height), 2); side >= kMinSide_px; side = divide_up(side, 2)) ++count_;
  if (levels_.size() < count_) levels_.resize(count_);
  levels_[0].resize(width, height);
}

void LumaPyramid::set_coarser() {
  for (size_t i = 1; i < count_; ++i) {
    const LumaLevel& above = levels_[i - 1];
    LumaLevel& level = levels_[i];
    level.resize(divide_up(above.width_px, 2), divide_up(above.height_px, 2));
    for (int y = 0; y < level.height_px; ++y) {
      halve_row(above.at(0, 2 * y), above.at(0, 2 * y + 1), level.width_px, level.at(0, y));
      repeat_ends(level, y);
    }
    repeat_first_and_last_row(level);
  }
}

void LumaPyramid::set_finest(const float* luma, int width_px, int height_px, int scale) {
  scale_ = scale;
  resize(width_px, height_px);
  LumaLevel& finest = levels_[0];
  for (int y = 0; y < height_px; ++y, luma += width_px) {
    std::copy(luma, luma + width_px, finest.at(0, y));
    repeat_ends(finest, y);
  }
  repeat_first_and_last_row(finest);
  set_coarser();
}

void LumaPyramid::copy_finest(float* luma) const {
  const LumaLevel& finest = levels_[0];
  for (int y = 0; y < finest.height_px; ++y, luma += finest.width_px) {
    std::copy(finest.at(0, y), finest.at(finest.width_px, y), luma);
  }
}

void LumaPyramid::set(const ImageView& image, WorkerThreads& threads) {
  require_no_depth(image);
  const Brightness as = brightness_of(image.format);
  scale_ = 1;
  while (2 * std::max(image.width_px, image.height_px) > 3 * kLongSide_px * scale_) scale_ *= 2;
  const int width = divide_up(image.width_px, scale_), height = divide_up(image.height_px, scale_);
  resize(width, height);
  means_.resize(size_t(width) * size_t(height));
  LumaLevel& finest = levels_[0];
  if (sums_.size() < size_t(threads.count())) {
    sums_.resize(size_t(threads.count()));
    columns_.resize(sums_.size());
  }
  const size_t tasks = size_t(divide_up(height, kGreyRowsOfTask));
  threads.run(tasks, [&](size_t task, int worker) {
    std::vector<int>& sums = sums_[size_t(worker)];
    sums.resize(size_t(image.width_px));
    for (int y = int(task) * kGreyRowsOfTask; y < std::min(int(task + 1) * kGreyRowsOfTask, height); ++y) {
      std::fill(sums.begin(), sums.end(), 0);
      const int begin = y * scale_, end = std::min(begin + scale_, image.height_px);
      for (int row = begin; row < end; ++row) {
        add_brightness(image.planes[0].data + size_t(row) * image.planes[0].stride_bytes, image.width_px, as,
                       sums.data());
      }
      mean_of_columns(sums.data(), image.width_px, scale_, end - begin, means_.data() + size_t(y) * size_t(width));
    }
  });
  threads.run(tasks, [&](size_t task, int worker) {
    std::vector<float>& columns = columns_[size_t(worker)];
    columns.resize(size_t(width) + 2);
    const auto row = [&](int y) { return means_.data() + size_t(std::clamp(y, 0, height - 1)) * size_t(width); };
    for (int y = int(task) * kGreyRowsOfTask; y < std::min(int(task + 1) * kGreyRowsOfTask, height); ++y) {
      smooth_row(row(y - 1), row(y), row(y + 1), width, columns.data(), finest.at(0, y));
      repeat_ends(finest, y);
    }
  });
  repeat_first_and_last_row(finest);
  set_coarser();
}

}  // namespace maq
