#include "drawing/health_drawing.h"

#include <imgui.h>
#include <algorithm>

namespace {

using maquette::HealthMoment;
using maquette::PredictionFrame;

constexpr size_t kMaxEventsListed = 5;
constexpr ImU32 kEventColour = IM_COL32(230, 60, 60, 255);

}  // namespace

void draw_red_cells(const std::vector<float>& values, int columns, const Reddening& reddening, const Rect& image) {
  if (values.empty()) return;
  const int rows = int(values.size()) / columns;
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  const auto colour = [&](int row, int column) {
    const float own = values[size_t(std::clamp(row, 0, rows - 1) * columns + std::clamp(column, 0, columns - 1))];
    const float fullness = (own - reddening.from) / (reddening.full - reddening.from);
    return IM_COL32(255, 0, 0, int(255 * reddening.max_red * std::clamp(fullness, 0.0f, 1.0f)));
  };
  // A line of the grid: the borders of the image, and between them the middles.
  const auto at = [](int i, int count, int from, int length) {
    return float(from) + std::clamp(float(i) - 0.5f, 0.0f, float(count)) * float(length) / float(count);
  };
  for (int row = 0; row <= rows; ++row) {
    const float top = at(row, rows, image.y, image.height), bottom = at(row + 1, rows, image.y, image.height);
    for (int column = 0; column <= columns; ++column) {
      const float left = at(column, columns, image.x, image.width),
                  right = at(column + 1, columns, image.x, image.width);
      list->AddRectFilledMultiColor({left, top}, {right, bottom}, colour(row - 1, column - 1), colour(row - 1, column),
                                    colour(row, column), colour(row, column - 1));
    }
  }
}

void draw_health_curve(const std::deque<HealthMoment>& moments, const Rect& rect, float scale) {
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  const ImVec2 from = {float(rect.x), float(rect.y)}, to = {from.x + float(rect.width), from.y + float(rect.height)};
  list->AddRectFilled(from, to, IM_COL32(20, 20, 24, 255));
  const auto y_of = [&](float unexplained) { return to.y - 1 - unexplained * (to.y - from.y - 2); };
  list->AddText({from.x + 4 * scale, from.y}, IM_COL32(150, 150, 156, 255), "unexplained by motion");
  const float step = std::max(1.0f, float(rect.width) / 300);
  float x = to.x - 1 - step * float(moments.size() - 1);
  for (size_t i = 0; i < moments.size(); ++i, x += step) {
    const maq_camera_health_result& now = moments[i].result;
    if (x < from.x) continue;
    if (now.event != MAQ_CAMERA_OK) {
      list->AddLine({x, from.y}, {x, to.y}, kEventColour, scale);
      list->AddText({x + 2 * scale, from.y}, kEventColour, maq_camera_event_get_name(now.event));
    }
    if (i == 0 || x - step < from.x) continue;
    list->AddLine({x - step, y_of(moments[i - 1].result.unexplained)}, {x, y_of(now.unexplained)},
                  IM_COL32(230, 230, 230, 255), 1.5f * scale);
  }
}

void draw_health_text(const PredictionFrame& frame, float scale) {
  if (frame.health.empty()) return;
  ImGui::Text("Camera: %s, checked in %.1f ms", maq_camera_event_get_name(frame.health.back().result.state),
              frame.health_ms);
  size_t count = 0;
  for (auto moment = frame.health.rbegin(); moment != frame.health.rend() && count < kMaxEventsListed; ++moment) {
    if (moment->result.event == MAQ_CAMERA_OK) continue;
    ++count;
    ImGui::TextColored(ImColor(kEventColour), "%.1f s", moment->time_s);
    ImGui::SameLine(60 * scale);
    ImGui::TextUnformatted(maq_camera_event_get_name(moment->result.event));
  }
  if (count == 0) ImGui::TextUnformatted("No event in the latest frames.");
}

nlohmann::ordered_json health_report(const PredictionFrame& frame) {
  nlohmann::ordered_json report;
  report["frames"] = frame.health.size();
  report["events"] = nlohmann::json::array();
  for (const HealthMoment& moment : frame.health) {
    if (moment.result.event == MAQ_CAMERA_OK) continue;
    report["events"].push_back({{"kind", maq_camera_event_get_name(moment.result.event)}, {"time_s", moment.time_s}});
  }
  return report;
}
