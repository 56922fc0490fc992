#include "prediction/surprise/code_surprise.h"

#include <algorithm>
#include <cmath>

namespace maq {
namespace {

constexpr float kStaysAtFirst = 0.7f;
constexpr float kReturns = 0.02f;  // of the weight, to each expert

}  // namespace

CodeSurprise::CodeSurprise(const FrameCodes& codes) : codes_(codes), before_(codes.count()), stays_(codes.count()) {
  for (size_t i = 0; i < probability_.size(); ++i) {
    probability_[i] = float(std::exp2(-double(i) / FrameCodes::kBitSteps));
  }
}

bool CodeSurprise::add(const uint16_t* codes, const float* foreseen, float* bits) {
  const size_t slices = codes_.slices, entries = codes_.entries;
  double of_frame = 0, by_themselves = 0;
  for (size_t place = 0; place < codes_.places(); ++place) {
    float sum = 0;
    for (size_t slice = 0; slice < slices; ++slice) {
      const size_t i = place * slices + slice, code = codes[i];
      const float rare = float(codes_.frequency_bits[slice * entries + code]) / FrameCodes::kBitSteps;
      by_themselves += double(rare);
      if (!has_frame_) {
        sum += rare;
        continue;
      }
      const float moves = foreseen != nullptr
                              ? std::exp2(-foreseen[i])
                              : probability_[codes_.after_bits[(slice * entries + before_[i]) * entries + code]];
      const float stays = codes[i] == before_[i] ? stays_[i] : 0.0f;
      const float likely = std::min(1.0f, stays + (1 - stays_[i]) * moves);
      sum -= std::log2(likely);
      stays_[i] = kReturns + (1 - 2 * kReturns) * (stays / likely);
    }
    bits[place] = sum / float(slices);
    of_frame += double(sum);
  }
  const bool is_cut = has_frame_ && of_frame >= by_themselves;
  if (!has_frame_ || is_cut) std::fill(stays_.begin(), stays_.end(), kStaysAtFirst);
  std::copy_n(codes, before_.size(), before_.begin());
  has_frame_ = true;
  return is_cut;
}

}  // namespace maq
