#include "drawing/novelty_drawing.h"

#include <imgui.h>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace {

using maquette::NoveltyMoment;
using maquette::PredictionFrame;

constexpr double kMinBits = 0.03, kMaxBits = 12;  // of the curve
constexpr size_t kMaxEventsListed = 5;
constexpr ImU32 kEventColour = IM_COL32(230, 60, 60, 255);

// 0 to 1 from the bottom to the top of the curve.
float height_of(double bits) {
  const double height = std::log(std::max(bits, kMinBits) / kMinBits) / std::log(kMaxBits / kMinBits);
  return float(std::clamp(height, 0.0, 1.0));
}

}  // namespace

void draw_red_cells(const std::vector<float>& bits, const Reddening& reddening, const Rect& image) {
  if (bits.empty()) return;
  const int side = int(std::lround(std::sqrt(double(bits.size()))));
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  const auto colour = [&](int row, int column) {
    const float own = bits[size_t(std::clamp(row, 0, side - 1) * side + std::clamp(column, 0, side - 1))];
    const float fullness = (own - reddening.from_bits) / (reddening.full_bits - reddening.from_bits);
    return IM_COL32(255, 0, 0, int(255 * reddening.max_red * std::clamp(fullness, 0.0f, 1.0f)));
  };
  // A line of the grid: the borders of the image, and between them the middles.
  const auto at = [&](int i, int from, int length) {
    return float(from) + std::clamp(float(i) - 0.5f, 0.0f, float(side)) * float(length) / float(side);
  };
  for (int row = 0; row <= side; ++row) {
    const float top = at(row, image.y, image.height), bottom = at(row + 1, image.y, image.height);
    for (int column = 0; column <= side; ++column) {
      const float left = at(column, image.x, image.width), right = at(column + 1, image.x, image.width);
      list->AddRectFilledMultiColor({left, top}, {right, bottom}, colour(row - 1, column - 1), colour(row - 1, column),
                                    colour(row, column), colour(row, column - 1));
    }
  }
}

void draw_novelty_curve(const std::deque<NoveltyMoment>& moments, const Rect& rect, float scale) {
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  const ImVec2 from = {float(rect.x), float(rect.y)}, to = {from.x + float(rect.width), from.y + float(rect.height)};
  list->AddRectFilled(from, to, IM_COL32(20, 20, 24, 255));
  const auto y_of = [&](double bits) { return to.y - 1 - height_of(bits) * (to.y - from.y - 2); };
  for (const auto& [bits, text] : {std::pair{0.1, "0.1 bits"}, {1.0, "1 bit"}, {10.0, "10 bits"}}) {
    list->AddLine({from.x, y_of(bits)}, {to.x, y_of(bits)}, IM_COL32(60, 60, 66, 255));
    list->AddText({from.x + 4 * scale, y_of(bits)}, IM_COL32(150, 150, 156, 255), text);
  }
  const float step = std::max(1.0f, float(rect.width) / 300);
  float x = to.x - 1 - step * float(moments.size() - 1);
  for (size_t i = 0; i < moments.size(); ++i, x += step) {
    const maq_novelty_score& now = moments[i].score;
    if (x < from.x) continue;
    if (now.is_event != 0) list->AddLine({x, from.y}, {x, to.y}, kEventColour, scale);
    if (i == 0 || now.is_stream_start != 0 || moments[i - 1].score.is_stream_start != 0 || x - step < from.x) continue;
    list->AddLine({x - step, y_of(double(moments[i - 1].score.bits))}, {x, y_of(double(now.bits))},
                  IM_COL32(230, 230, 230, 255), 1.5f * scale);
  }
}

void draw_novelty_text(const PredictionFrame& frame, float scale) {
  if (frame.novelty.empty()) return;
  const maq_novelty_score& score = frame.novelty.back().score;
  ImGui::Text("%.2f bits a code, %.1f times the usual, in %.1f ms", double(score.bits), double(score.ratio),
              frame.novelty_ms);
  size_t count = 0;
  for (auto moment = frame.novelty.rbegin(); moment != frame.novelty.rend() && count < kMaxEventsListed; ++moment) {
    if (moment->score.is_event == 0) continue;
    ++count;
    ImGui::TextColored(ImColor(kEventColour), "%.1f s", moment->time_s);
    ImGui::SameLine(60 * scale);
    ImGui::Text("%.2f bits, %.1f times%s", double(moment->score.bits), double(moment->score.ratio),
                moment->score.is_cut != 0 ? ", a cut" : "");
  }
  if (count == 0) ImGui::TextUnformatted("No event in the latest frames.");
}

nlohmann::ordered_json novelty_report(const PredictionFrame& frame) {
  nlohmann::ordered_json report;
  report["frames"] = frame.novelty.size();
  report["events_s"] = nlohmann::json::array();
  for (const NoveltyMoment& moment : frame.novelty) {
    if (moment.score.is_event != 0) report["events_s"].push_back(moment.time_s);
  }
  if (!frame.novelty.empty()) report["bits"] = frame.novelty.back().score.bits;
  return report;
}
