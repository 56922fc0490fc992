#include "drawing/stage_chart.h"

#include <imgui.h>
#include <algorithm>
#include <cstdio>
#include <vector>

namespace {

constexpr size_t kMaxFrames = 200;
constexpr ImU32 kColours[] = {IM_COL32(88, 140, 232, 255),  IM_COL32(80, 200, 200, 255), IM_COL32(100, 200, 110, 255),
                              IM_COL32(236, 190, 70, 255),  IM_COL32(240, 130, 60, 255), IM_COL32(214, 90, 110, 255),
                              IM_COL32(170, 110, 210, 255), IM_COL32(150, 120, 90, 255), IM_COL32(110, 110, 118, 255)};

}  // namespace

void StageChart::add(const Times& times_ms) {
  times_ms_.push_back(times_ms);
  if (times_ms_.size() > kMaxFrames) times_ms_.pop_front();
}

void StageChart::draw(const char* const* names, size_t count, float scale) const {
  const float width = ImGui::GetContentRegionAvail().x, height = 110 * scale;
  const ImVec2 from = ImGui::GetCursorScreenPos(), to(from.x + width, from.y + height);
  ImDrawList* const list = ImGui::GetWindowDrawList();
  list->AddRectFilled(from, to, IM_COL32(28, 28, 32, 255));
  std::vector<float> totals;
  for (const Times& times : times_ms_) {
    float sum = 0;
    for (size_t k = 0; k < count; ++k) sum += times[k];
    totals.push_back(sum);
  }
  std::sort(totals.begin(), totals.end());
  // A rare long frame is clipped rather than making the others small.
  const float full_ms = totals.empty() ? 1 : std::max(1.0f, 1.25f * totals[totals.size() * 95 / 100]);
  const float step = width / kMaxFrames;
  for (size_t i = 0; i < times_ms_.size(); ++i) {
    float top = to.y;
    for (size_t k = 0; k < count; ++k) {
      const float next = std::max(from.y, top - times_ms_[i][k] / full_ms * height), x = from.x + float(i) * step;
      if (next < top) list->AddRectFilled({x, next}, {x + step, top}, kColours[k]);
      top = next;
    }
  }
  char text[40];
  std::snprintf(text, sizeof text, "%.0f ms", double(full_ms));
  list->AddText({from.x + 4, from.y + 2}, IM_COL32(200, 200, 200, 255), text);
  ImGui::Dummy({width, height + 2});
  for (size_t k = 0; k < count; ++k) {
    if (k % 2 != 0) ImGui::SameLine(width / 2);
    ImGui::TextColored(ImColor(kColours[k]), "%s %.1f ms", names[k],
                       times_ms_.empty() ? 0.0 : double(times_ms_.back()[k]));
  }
  ImGui::Separator();
}
