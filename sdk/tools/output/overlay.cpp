#include "output/overlay.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

namespace {

constexpr int kReadableSidePx = 900;
constexpr int kLargestEnlargement = 4;
constexpr int kParts = 24;
constexpr float kContoursPerPart = 8;  // iso-lines of U, and as many of V
constexpr float kPaint = 0.70f;        // opacity of the parts' colours
constexpr Bgr kInk = {48, 26, 24};

// A plane of the result.
class Plane {
 public:
  Plane(const maquette::DensePoseResult& result, maq_densepose_plane plane) : bytes_(result.plane(plane, &stride_)) {}
  uint8_t at(int x, int y) const { return bytes_[size_t(y) * stride_ + size_t(x)]; }

 private:
  size_t stride_ = 0;
  const uint8_t* bytes_;
};

struct Planes {
  explicit Planes(const maquette::DensePoseResult& result)
      : part(result, MAQ_DENSEPOSE_PLANE_PART),
        u(result, MAQ_DENSEPOSE_PLANE_U),
        v(result, MAQ_DENSEPOSE_PLANE_V),
        person(result, MAQ_DENSEPOSE_PLANE_PERSON) {}
  Plane part, u, v, person;
};

// A part of the image.
struct Area {
  int x, y;
  PictureSide size;
};

float smooth_step(float low, float high, float value) {
  const float t = std::clamp((value - low) / (high - low), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

// One person's surface, enlarged: which part, how much of the pixel it covers, and U and V as smooth functions.
struct Surface {
  explicit Surface(const Area& enlarged)
      : area(enlarged),
        parts(size_t(enlarged.size.width) * size_t(enlarged.size.height)),
        coverage(enlarged.size),
        u(enlarged.size),
        v(enlarged.size) {}
  uint8_t& part(int x, int y) { return parts[size_t(y) * size_t(area.size.width) + size_t(x)]; }
  uint8_t part(int x, int y) const { return parts[size_t(y) * size_t(area.size.width) + size_t(x)]; }

  Area area;  // in the enlarged image
  std::vector<uint8_t> parts;
  FloatPlane coverage, u, v;
};

// Enlarges one part at a time, so that nothing bleeds over from its neighbours: bytes of U and V are steps, and a
// blur weighted with the part's own mask turns them into slopes whose contours are lines.
Surface enlarge(const Planes& planes, int person, const Area& box, int scale) {
  Surface surface({box.x * scale, box.y * scale, {box.size.width * scale, box.size.height * scale}});
  const PictureSide size = surface.area.size;
  FloatPlane strongest(size);
  const double sigma = 0.75 * scale + 0.5;
  for (int p = 1; p <= kParts; ++p) {
    FloatPlane weight(box.size), u(box.size), v(box.size);
    bool is_seen = false;
    for (int y = 0; y < box.size.height; ++y) {
      for (int x = 0; x < box.size.width; ++x) {
        const int column = box.x + x, row = box.y + y;
        if (planes.person.at(column, row) != person || planes.part.at(column, row) != p) continue;
        is_seen = true;
        weight.at(x, y) = 1;
        u.at(x, y) = float(planes.u.at(column, row)) / 255;
        v.at(x, y) = float(planes.v.at(column, row)) / 255;
      }
    }
    if (!is_seen) continue;
    for (FloatPlane* plane : {&weight, &u, &v}) {
      *plane = plane->resized(size);
      plane->blur(sigma);
    }
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        const float w = weight.at(x, y);
        surface.coverage.at(x, y) += w;
        if (w <= strongest.at(x, y) || w < 1e-3f) continue;
        strongest.at(x, y) = w;
        surface.part(x, y) = uint8_t(p);
        surface.u.at(x, y) = u.at(x, y) / w;
        surface.v.at(x, y) = v.at(x, y) / w;
      }
    }
  }
  return surface;
}

// How strongly an iso-line of `plane` marks this pixel: its distance to the nearest line in pixels, from the slope.
float contour(const Surface& surface, const FloatPlane& plane, int x, int y, float half_width_px) {
  const auto slope = [&](int dx, int dy) {
    const int x1 = x + dx, y1 = y + dy, x0 = x - dx, y0 = y - dy;
    if (x0 < 0 || y0 < 0 || x1 >= plane.size.width || y1 >= plane.size.height) return 0.0f;
    const uint8_t part = surface.part(x, y);
    if (surface.part(x1, y1) != part || surface.part(x0, y0) != part) return 0.0f;
    return (plane.at(x1, y1) - plane.at(x0, y0)) * 0.5f * kContoursPerPart;
  };
  const float across = slope(1, 0), down = slope(0, 1), steepness = std::sqrt(across * across + down * down);
  if (steepness < 1e-4f) return 0;
  const float level = plane.at(x, y) * kContoursPerPart;
  const float distance_px = std::abs(level - std::round(level)) / steepness;
  // Where lines would lie closer than they are wide, they fade instead of filling the part.
  return (1 - smooth_step(half_width_px - 0.5f, half_width_px + 0.5f, distance_px)) *
         (1 - smooth_step(0.15f, 0.45f, steepness));
}

bool is_part_border(const Surface& surface, int x, int y) {
  const uint8_t part = surface.part(x, y);
  return (x + 1 < surface.area.size.width && surface.part(x + 1, y) != part) ||
         (y + 1 < surface.area.size.height && surface.part(x, y + 1) != part);
}

void paint(const Surface& surface, float line_px, Canvas& canvas) {
  std::array<Bgr, kParts + 1> colours;
  for (int p = 0; p <= kParts; ++p) {
    uint8_t rgb[3];
    maq_densepose_get_part_colour(p, rgb);
    colours[size_t(p)] = {rgb[2], rgb[1], rgb[0]};
  }
  constexpr Bgr kWhite = {255, 255, 255};
  for (int y = 0; y < surface.area.size.height; ++y) {
    for (int x = 0; x < surface.area.size.width; ++x) {
      const float coverage = surface.coverage.at(x, y);
      const float inside = smooth_step(0.4f, 0.6f, coverage);
      const uint8_t part = surface.part(x, y);
      if (part == 0 || inside <= 0) continue;
      const auto mix = [&](Bgr colour, float amount) {
        canvas.mix(surface.area.x + x, surface.area.y + y, colour, amount);
      };
      mix(colours[part], kPaint * inside);
      mix(kWhite, 0.75f * inside * contour(surface, surface.u, x, y, 0.5f * line_px));
      mix(kInk, 0.65f * inside * contour(surface, surface.v, x, y, 0.5f * line_px));
      if (is_part_border(surface, x, y)) mix(kInk, 0.35f * inside);
      // The outline follows the half-covered edge.
      mix(kWhite, 0.8f * (1 - smooth_step(0.08f, 0.22f, std::abs(coverage - 0.5f))));
    }
  }
}

void draw_box(const maq_densepose_person& person, int scale, Canvas& canvas) {
  constexpr Bgr kWhite = {255, 255, 255};
  const auto scaled = [&](int i) { return double(person.box_px[i]) * scale; };
  const CanvasPoint corner{scaled(0), scaled(1)}, opposite{scaled(2), scaled(3)};
  const int thickness = std::max(1, std::max(canvas.width(), canvas.height()) / 640);
  canvas.outline(corner, opposite, thickness + 2, kInk);
  canvas.outline(corner, opposite, thickness, kWhite);

  char text[40];
  std::snprintf(text, sizeof text, "#%lld %.2f", static_cast<long long>(person.id), double(person.score));
  const PictureSide size = Canvas::text_size(text, thickness);
  const int pad = 4 * thickness;
  const int left = std::clamp(int(corner.x), 0, std::max(0, canvas.width() - size.width - 2 * pad));
  // Above the box, or inside it where there is no room above.
  int top = int(corner.y) - size.height - 2 * pad;
  if (top < 0) top = int(corner.y);
  canvas.fill(left, top, {size.width + 2 * pad, size.height + 2 * pad}, kWhite);
  canvas.text(text, left + pad, top + pad, thickness, kInk);
}

// Lines between keypoints of enough confidence: cool to the person's left, warm to the right, as the parts.
void draw_skeleton(const maquette::DensePoseResult& result, uint32_t person, int scale, Canvas& canvas) {
  constexpr float kMinConfidence = 0.15f;
  static constexpr Bgr kLeft = {255, 200, 60}, kRight = {70, 120, 255}, kMiddle = {255, 255, 255};
  const auto keypoints = result.keypoints(person);
  const double width = std::max(2.0, std::max(canvas.width(), canvas.height()) / 350.0);
  const auto place = [&](size_t k) {
    return CanvasPoint{double(keypoints[k][0]) * scale - 0.5, double(keypoints[k][1]) * scale - 0.5};
  };
  const auto colour_of = [](size_t k) {
    const std::string name = maq_densepose_get_keypoint_name(int32_t(k));
    return name.find("left") != std::string::npos ? kLeft : name.find("right") != std::string::npos ? kRight : kMiddle;
  };
  for (const bool is_shadow : {true, false}) {
    for (const maquette::Bone& bone : maquette::kSkeleton) {
      if (std::min(keypoints[bone.from][2], keypoints[bone.to][2]) < kMinConfidence) continue;
      const bool is_across = colour_of(bone.from) != colour_of(bone.to) && bone.from != MAQ_DENSEPOSE_KEYPOINT_NOSE;
      canvas.line(place(bone.from), place(bone.to), is_shadow ? width + 2 : width,
                  is_shadow   ? kInk
                  : is_across ? kMiddle
                              : colour_of(bone.to));
    }
  }
  for (size_t k = 0; k < keypoints.size(); ++k) {
    if (keypoints[k][2] >= kMinConfidence) canvas.disc(place(k), width, colour_of(k));
  }
}

// The smallest area with all pixels of a person, and two more on each side; none: no width.
Area area_of(const Plane& persons, int person, PictureSide size) {
  int left = size.width, top = size.height, right = 0, bottom = 0;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      if (persons.at(x, y) != person) continue;
      left = std::min(left, x);
      right = std::max(right, x + 1);
      top = std::min(top, y);
      bottom = y + 1;
    }
  }
  if (right == 0) return {0, 0, {}};
  left = std::max(left - 2, 0);
  top = std::max(top - 2, 0);
  return {left, top, {std::min(right + 2, size.width) - left, std::min(bottom + 2, size.height) - top}};
}

}  // namespace

Canvas draw_overlay(const Canvas& image, const maquette::DensePoseResult& result, bool has_keypoints) {
  const int scale = std::clamp(kReadableSidePx / std::max(image.width(), image.height()), 1, kLargestEnlargement);
  Canvas canvas = image.resized({image.width() * scale, image.height() * scale});
  // The people stand out from a slightly darkened image.
  const std::vector<maq_densepose_person> people = result.people();
  if (!people.empty()) {
    for (uint8_t& value : canvas.bgr) value = uint8_t(float(value) * 0.82f + 0.5f);
  }
  const Planes planes(result);
  const float line_px = std::max(1.0f, float(std::max(canvas.width(), canvas.height())) / 900.0f);
  for (size_t k = people.size(); k-- > 0;) {
    const Area box = area_of(planes.person, int(k + 1), image.size());
    if (box.size.width > 0) paint(enlarge(planes, int(k + 1), box, scale), line_px, canvas);
  }
  for (size_t k = people.size(); has_keypoints && k-- > 0;) draw_skeleton(result, uint32_t(k), scale, canvas);
  // The best last, so that its label is on top.
  for (size_t k = people.size(); k-- > 0;) draw_box(people[k], scale, canvas);
  return canvas;
}

Canvas draw_parts(const maquette::DensePoseResult& result, maq_densepose_colours colours) {
  maq_densepose_drawing drawing{};
  maquette::check(maq_densepose_drawing_init(&drawing, sizeof drawing));
  drawing.opacity = 255;
  drawing.colours = colours;
  Canvas canvas({result.width_px(), result.height_px()});
  std::vector<uint8_t> rgba(canvas.bgr.size() / 3 * 4);
  result.draw(nullptr, drawing, rgba.data(), 0, rgba.size());
  const Bgr ground = colours == MAQ_DENSEPOSE_COLOURS_MAGICANIMATE ? Bgr{84, 1, 68} : Bgr{};
  for (size_t i = 0; i < rgba.size() / 4; ++i) {
    const uint8_t* const from = &rgba[4 * i];
    for (size_t c = 0; c < 3; ++c) canvas.bgr[3 * i + c] = from[3] == 0 ? ground[c] : from[2 - c];
  }
  return canvas;
}
