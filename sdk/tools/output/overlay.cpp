#include "output/overlay.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace {

constexpr int kReadableSidePx = 900;
constexpr int kLargestEnlargement = 4;
constexpr int kParts = 24;
constexpr float kContoursPerPart = 8;  // iso-lines of U, and as many of V
constexpr float kPaint = 0.70f;        // opacity of the parts' colours

// A plane of the result as an image of the result's memory.
cv::Mat plane_of(const maquette::DensePoseResult& result, maq_densepose_plane plane) {
  size_t stride_bytes = 0;
  const uint8_t* pixels = result.plane(plane, &stride_bytes);
  return cv::Mat(result.height_px(), result.width_px(), CV_8UC1, const_cast<uint8_t*>(pixels), stride_bytes);
}

float smooth_step(float low, float high, float value) {
  const float t = std::clamp((value - low) / (high - low), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

// One person's surface, enlarged: which part, how much of the pixel it covers, and U and V as smooth functions.
struct Surface {
  cv::Rect area;     // in the enlarged image
  cv::Mat part;      // CV_8U
  cv::Mat coverage;  // CV_32F
  cv::Mat u, v;      // CV_32F
};

// Enlarges one part at a time, so that nothing bleeds over from its neighbours: bytes of U and V are steps, and a
// blur weighted with the part's own mask turns them into slopes whose contours are lines.
Surface enlarge(const cv::Mat& part, const cv::Mat& u, const cv::Mat& v, const cv::Mat& mine, const cv::Rect& box,
                int scale) {
  const cv::Size size(box.width * scale, box.height * scale);
  Surface surface;
  surface.area = cv::Rect(box.x * scale, box.y * scale, size.width, size.height);
  surface.part = cv::Mat::zeros(size, CV_8U);
  surface.coverage = cv::Mat::zeros(size, CV_32F);
  surface.u = cv::Mat::zeros(size, CV_32F);
  surface.v = cv::Mat::zeros(size, CV_32F);
  cv::Mat strongest = cv::Mat::zeros(size, CV_32F);
  const double sigma = 0.75 * scale + 0.5;
  for (int p = 1; p <= kParts; ++p) {
    cv::Mat mask = mine & (part == p);
    if (cv::countNonZero(mask) == 0) continue;
    cv::Mat weight, weighted_u, weighted_v, planes[2];
    mask.convertTo(weight, CV_32F, 1 / 255.0);
    u.convertTo(planes[0], CV_32F, 1 / 255.0);
    v.convertTo(planes[1], CV_32F, 1 / 255.0);
    const auto smooth = [&](const cv::Mat& plane) {
      cv::Mat large;
      cv::resize(plane, large, size, 0, 0, cv::INTER_LINEAR);
      cv::GaussianBlur(large, large, cv::Size(), sigma, sigma, cv::BORDER_REPLICATE);
      return large;
    };
    weighted_u = smooth(planes[0].mul(weight));
    weighted_v = smooth(planes[1].mul(weight));
    weight = smooth(weight);
    surface.coverage += weight;
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        const float w = weight.at<float>(y, x);
        if (w <= strongest.at<float>(y, x) || w < 1e-3f) continue;
        strongest.at<float>(y, x) = w;
        surface.part.at<uint8_t>(y, x) = uint8_t(p);
        surface.u.at<float>(y, x) = weighted_u.at<float>(y, x) / w;
        surface.v.at<float>(y, x) = weighted_v.at<float>(y, x) / w;
      }
    }
  }
  return surface;
}

// How strongly an iso-line of `plane` marks this pixel: its distance to the nearest line in pixels, from the slope.
float contour(const Surface& surface, const cv::Mat& plane, int x, int y, float half_width_px) {
  const auto slope = [&](int dx, int dy) {
    const int x1 = x + dx, y1 = y + dy, x0 = x - dx, y0 = y - dy;
    if (x0 < 0 || y0 < 0 || x1 >= plane.cols || y1 >= plane.rows) return 0.0f;
    const uint8_t part = surface.part.at<uint8_t>(y, x);
    if (surface.part.at<uint8_t>(y1, x1) != part || surface.part.at<uint8_t>(y0, x0) != part) return 0.0f;
    return (plane.at<float>(y1, x1) - plane.at<float>(y0, x0)) * 0.5f * kContoursPerPart;
  };
  const float steepness = std::hypot(slope(1, 0), slope(0, 1));
  if (steepness < 1e-4f) return 0;
  const float level = plane.at<float>(y, x) * kContoursPerPart;
  const float distance_px = std::abs(level - std::round(level)) / steepness;
  // Where lines would lie closer than they are wide, they fade instead of filling the part.
  return (1 - smooth_step(half_width_px - 0.5f, half_width_px + 0.5f, distance_px)) *
         (1 - smooth_step(0.15f, 0.45f, steepness));
}

bool is_part_border(const Surface& surface, int x, int y) {
  const uint8_t part = surface.part.at<uint8_t>(y, x);
  return (x + 1 < surface.part.cols && surface.part.at<uint8_t>(y, x + 1) != part) ||
         (y + 1 < surface.part.rows && surface.part.at<uint8_t>(y + 1, x) != part);
}

void mix(cv::Vec3b& pixel, const std::array<uint8_t, 3>& rgb, float amount) {
  for (int c = 0; c < 3; ++c) {
    pixel[c] = cv::saturate_cast<uint8_t>(pixel[c] + (float(rgb[size_t(2 - c)]) - pixel[c]) * amount);
  }
}

void paint(const Surface& surface, float line_px, cv::Mat& canvas) {
  std::array<std::array<uint8_t, 3>, kParts + 1> colours;
  for (int p = 0; p <= kParts; ++p) maq_densepose_get_part_colour(p, colours[size_t(p)].data());
  constexpr std::array<uint8_t, 3> kWhite = {255, 255, 255};
  constexpr std::array<uint8_t, 3> kInk = {24, 26, 48};
  cv::Mat target = canvas(surface.area);
  for (int y = 0; y < target.rows; ++y) {
    for (int x = 0; x < target.cols; ++x) {
      const float coverage = surface.coverage.at<float>(y, x);
      const float inside = smooth_step(0.4f, 0.6f, coverage);
      const uint8_t part = surface.part.at<uint8_t>(y, x);
      if (part == 0 || inside <= 0) continue;
      cv::Vec3b& pixel = target.at<cv::Vec3b>(y, x);
      mix(pixel, colours[part], kPaint * inside);
      mix(pixel, kWhite, 0.75f * inside * contour(surface, surface.u, x, y, 0.5f * line_px));
      mix(pixel, kInk, 0.65f * inside * contour(surface, surface.v, x, y, 0.5f * line_px));
      if (is_part_border(surface, x, y)) mix(pixel, kInk, 0.35f * inside);
      // The outline follows the half-covered edge.
      mix(pixel, kWhite, 0.8f * (1 - smooth_step(0.08f, 0.22f, std::abs(coverage - 0.5f))));
    }
  }
}

void draw_box(const maq_densepose_person& person, int scale, cv::Mat& canvas) {
  constexpr int kShift = 3;  // sub-pixel digits of OpenCV's coordinates
  const auto fixed = [&](float at) { return int(std::lround(double(at) * scale * (1 << kShift))); };
  const cv::Point corner(fixed(person.box_px[0]), fixed(person.box_px[1]));
  const cv::Point opposite(fixed(person.box_px[2]), fixed(person.box_px[3]));
  const int thickness = std::max(1, std::max(canvas.cols, canvas.rows) / 640);
  cv::rectangle(canvas, corner, opposite, cv::Scalar(40, 26, 24), thickness + 2, cv::LINE_AA, kShift);
  cv::rectangle(canvas, corner, opposite, cv::Scalar(255, 255, 255), thickness, cv::LINE_AA, kShift);

  char text[16];
  std::snprintf(text, sizeof text, "%.2f", double(person.score));
  const double font_scale = 0.42 * thickness;
  int baseline = 0;
  const cv::Size size = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, font_scale, thickness, &baseline);
  const int pad = 4 * thickness;
  const int left = std::clamp(corner.x >> kShift, 0, std::max(0, canvas.cols - size.width - 2 * pad));
  // Above the box, or inside it where there is no room above.
  int top = (corner.y >> kShift) - size.height - 2 * pad;
  if (top < 0) top = corner.y >> kShift;
  const cv::Rect label = cv::Rect(left, top, size.width + 2 * pad, size.height + 2 * pad);
  cv::rectangle(canvas, label, cv::Scalar(255, 255, 255), cv::FILLED);
  cv::putText(canvas, text, cv::Point(left + pad, top + pad + size.height), cv::FONT_HERSHEY_SIMPLEX, font_scale,
              cv::Scalar(40, 26, 24), thickness, cv::LINE_AA);
}

}  // namespace

cv::Mat draw_overlay(const cv::Mat& image, const maquette::DensePoseResult& result) {
  const int scale = std::clamp(kReadableSidePx / std::max(image.cols, image.rows), 1, kLargestEnlargement);
  cv::Mat canvas;
  cv::resize(image, canvas, image.size() * scale, 0, 0, scale == 1 ? cv::INTER_NEAREST : cv::INTER_CUBIC);
  // The people stand out from a slightly darkened image.
  const std::vector<maq_densepose_person> people = result.people();
  if (!people.empty()) canvas.convertTo(canvas, -1, 0.82, 0);

  const cv::Mat part = plane_of(result, MAQ_DENSEPOSE_PLANE_PART);
  const cv::Mat u = plane_of(result, MAQ_DENSEPOSE_PLANE_U);
  const cv::Mat v = plane_of(result, MAQ_DENSEPOSE_PLANE_V);
  const cv::Mat person = plane_of(result, MAQ_DENSEPOSE_PLANE_PERSON);
  const float line_px = std::max(1.0f, float(std::max(canvas.cols, canvas.rows)) / 900.0f);
  const cv::Rect frame(cv::Point(), image.size());
  for (size_t k = people.size(); k-- > 0;) {
    const cv::Mat mine = person == double(k + 1);
    cv::Rect box = cv::boundingRect(mine);
    if (box.empty()) continue;
    box = cv::Rect(box.x - 2, box.y - 2, box.width + 4, box.height + 4) & frame;
    paint(enlarge(part(box), u(box), v(box), mine(box), box, scale), line_px, canvas);
  }
  // The best last, so that its label is on top.
  for (size_t k = people.size(); k-- > 0;) draw_box(people[k], scale, canvas);
  return canvas;
}

cv::Mat draw_parts(const maquette::DensePoseResult& result, maq_densepose_colours colours) {
  maq_densepose_drawing drawing{};
  maquette::check(maq_densepose_drawing_init(&drawing, sizeof drawing));
  drawing.opacity = 255;
  drawing.colours = colours;
  cv::Mat rgba(result.height_px(), result.width_px(), CV_8UC4), bgr;
  result.draw(nullptr, drawing, rgba.data, 0, rgba.total() * rgba.elemSize());
  cv::Mat is_ground;
  cv::extractChannel(rgba, is_ground, 3);
  is_ground = is_ground == 0;
  cv::cvtColor(rgba, bgr, cv::COLOR_RGBA2BGR);
  if (colours == MAQ_DENSEPOSE_COLOURS_MAGICANIMATE) bgr.setTo(cv::Scalar(84, 1, 68), is_ground);
  return bgr;
}
