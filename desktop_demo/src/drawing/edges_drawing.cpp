#include "drawing/edges_drawing.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

namespace {

constexpr ImU32 kDark = IM_COL32(15, 15, 20, 255), kPaper = IM_COL32(20, 20, 24, 210);
constexpr const char* kTypeNames[] = {"line", "arc", "spline"};

ImU32 colour_of(const maquette::Rgb& rgb) { return IM_COL32(rgb.r, rgb.g, rgb.b, 255); }

ImU32 colour_of(const maq_edges_curve& curve) {
  return colour_of(maquette::kEdgeGroupColours[size_t(maquette::group_of(curve))]);
}

template <class... Values>
std::string formatted(const char* format, Values... values) {
  char text[160];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

double range_m(const double* point_m) { return std::hypot(point_m[0], point_m[1], point_m[2]); }

}  // namespace

std::string text_of(const maq_edges_box& box) {
  std::string text;
  for (size_t i = 0; i < 3; ++i) {
    text += formatted("%s%.0f ± %.0f", i == 0 ? "" : " x ", 1e3 * box.size_m[i], 1e3 * box.size_tolerance_m[i]);
  }
  return text + " mm";
}

EdgesDrawing::EdgesDrawing(const maquette::EdgesFrame& frame, const Rect& rect, float scale)
    : frame_(frame),
      camera_(frame.result->field().intrinsics),
      rect_(rect),
      scale_(scale),
      px_(float(rect.width) / float(std::max(1, frame.picture.width_px))),
      list_(ImGui::GetBackgroundDrawList()) {
  const ImVec2 from(float(rect.x), float(rect.y));
  list_->PushClipRect(from, {from.x + float(rect.width), from.y + float(rect.height)});
}

EdgesDrawing::~EdgesDrawing() { list_->PopClipRect(); }

// Points far outside of the image are moved nearer to it.
ImVec2 EdgesDrawing::on_screen(const maquette::Pixel& at) const {
  const auto place = [&](double pixel, int from, int side) {
    const double units = (pixel + 0.5) * double(px_);
    return float(from) + float(std::clamp(units, -4.0 * side, 5.0 * side));
  };
  return {place(at[0], rect_.x, rect_.width), place(at[1], rect_.y, rect_.height)};
}

maquette::Pixel EdgesDrawing::frame_pixel(const ImVec2& at) const {
  return {double((at.x - float(rect_.x)) / px_) - 0.5, double((at.y - float(rect_.y)) / px_) - 0.5};
}

void EdgesDrawing::polyline(const double* points_m, size_t count, ImU32 colour, float width) const {
  std::vector<ImVec2> line;
  for (size_t i = 0; i < count; ++i) {
    if (points_m[3 * i + 2] > 0) line.push_back(on_screen(points_m + 3 * i));
  }
  list_->AddPolyline(line.data(), int(line.size()), colour, 0, width * scale_);
}

void EdgesDrawing::curves(int highlighted) const {
  // First what is dark about them, so that none hides another.
  for (const bool is_dark : {true, false}) {
    for (size_t i = 0; i < frame_.curves.size(); ++i) {
      const maq_edges_curve& curve = frame_.curves[i];
      const float width = int(i) == highlighted ? 4.5f : 2.5f;
      polyline(curve.points_m, curve.point_count, is_dark ? kDark : colour_of(curve), is_dark ? width + 2 : width);
    }
  }
  for (const maq_edges_corner& corner : frame_.corners) {
    if (!(corner.point_m[2] > 0)) continue;
    list_->AddCircleFilled(on_screen(corner.point_m), 4.5f * scale_, kDark);
    list_->AddCircleFilled(on_screen(corner.point_m), 3.5f * scale_, colour_of(maquette::kCornerColour));
  }
}

void EdgesDrawing::outlines() const {
  const ImU32 colour = colour_of(maquette::kBoxColour);
  for (const maq_edges_box& box : frame_.boxes) {
    for (const auto& edge : maquette::lines_of(box).edges) polyline(edge[0].data(), 2, colour, 1.5f);  // six doubles
  }
}

void EdgesDrawing::lengths() const {
  for (const maq_edges_box& box : frame_.boxes) {
    const maquette::BoxLines lines = maquette::lines_of(box);
    for (size_t axis = 0; axis < 3; ++axis) {
      if (!(lines.labels[axis][2] > 0)) continue;
      label(on_screen(lines.labels[axis].data()),
            formatted("%.0f ± %.0f mm", 1e3 * box.size_m[axis], 1e3 * box.size_tolerance_m[axis]),
            colour_of(maquette::kBoxColour));
    }
  }
}

void EdgesDrawing::label(const ImVec2& middle, const std::string& text, ImU32 colour) const {
  const ImVec2 size = ImGui::CalcTextSize(text.c_str());
  const float margin = 4 * scale_;
  const ImVec2 from(middle.x - size.x / 2, middle.y - size.y / 2);
  list_->AddRectFilled({from.x - margin, from.y - margin / 2}, {from.x + size.x + margin, from.y + size.y + margin / 2},
                       kPaper, margin);
  list_->AddText(from, colour, text.c_str());
}

void EdgesDrawing::legend() const {
  constexpr size_t kGroups = maquette::kEdgeGroupNames.size();
  size_t counts[kGroups] = {};
  for (const maq_edges_curve& curve : frame_.curves) ++counts[size_t(maquette::group_of(curve))];
  const float line = ImGui::GetTextLineHeight(), margin = 6 * scale_, sample = 16 * scale_;
  const float width = sample + margin + ImGui::CalcTextSize("concave crease: 0000").x;
  const ImVec2 from(float(rect_.x) + 2 * margin, float(rect_.y + rect_.height) - 2 * margin - float(kGroups) * line);
  list_->AddRectFilled({from.x - margin, from.y - margin}, {from.x + width, from.y + float(kGroups) * line + margin},
                       kPaper, margin);
  for (size_t k = 0; k < kGroups; ++k) {
    const float y = from.y + float(k) * line;
    list_->AddLine({from.x, y + line / 2}, {from.x + sample, y + line / 2}, colour_of(maquette::kEdgeGroupColours[k]),
                   2.5f * scale_);
    const std::string text = formatted("%s: %zu", maquette::kEdgeGroupNames[k], counts[k]);
    list_->AddText({from.x + sample + margin, y}, IM_COL32(230, 230, 230, 255), text.c_str());
  }
}

void EdgesDrawing::pointer(const maquette::EdgesPick& pick, const maquette::Pixel& at) const {
  std::string text;
  if (pick.snap.target != MAQ_EDGES_SNAP_NOTHING) {
    const ImVec2 place = on_screen(pick.snap.point_m);
    const float radius = 7 * scale_;
    const ImU32 colour = IM_COL32_WHITE;
    const double away_m = range_m(pick.snap.point_m);
    if (pick.snap.target == MAQ_EDGES_SNAP_CORNER) {
      list_->AddRect({place.x - radius, place.y - radius}, {place.x + radius, place.y + radius}, colour, 0, 0,
                     2 * scale_);
      const int count = frame_.corners[size_t(pick.snap.index)].curve_count;
      text = formatted("corner of %d edges, %.3f m away", count, away_m);
    } else if (pick.snap.target == MAQ_EDGES_SNAP_CURVE) {
      list_->AddCircle(place, radius, colour, 0, 2 * scale_);
      text = formatted("on an edge, %.3f m away", away_m);
    } else {
      list_->AddLine({place.x - radius, place.y}, {place.x + radius, place.y}, colour, 1.5f * scale_);
      list_->AddLine({place.x, place.y - radius}, {place.x, place.y + radius}, colour, 1.5f * scale_);
      text = formatted("on a plane, %.3f m away", away_m);
    }
  }
  if (pick.curve >= 0) {
    const maq_edges_curve& curve = frame_.curves[size_t(pick.curve)];
    const char* const group = maquette::kEdgeGroupNames[size_t(maquette::group_of(curve))];
    text += formatted("%sedge %d: %s, %s, %.0f mm", text.empty() ? "" : "\n", pick.curve, kTypeNames[curve.type], group,
                      1e3 * curve.length_m);
  }
  if (text.empty()) return;
  const ImVec2 size = ImGui::CalcTextSize(text.c_str());
  const float right = float(rect_.x + rect_.width) - size.x / 2 - 8 * scale_;
  const ImVec2 from = on_screen(at);
  label({std::min(from.x + 16 * scale_ + size.x / 2, right), from.y + 16 * scale_ + size.y / 2}, text, IM_COL32_WHITE);
}
