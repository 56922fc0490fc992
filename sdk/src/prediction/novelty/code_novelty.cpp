#include "prediction/novelty/code_novelty.h"

#include <algorithm>
#include <cmath>

namespace maq {
namespace {

constexpr float kStaysAtFirst = 0.7f;
constexpr float kReturns = 0.02f;  // of the weight, to each expert

}  // namespace

CodeNovelty::CodeNovelty(const FrameCodes& codes) : codes_(codes), before_(codes.count()), stays_(codes.count()) {
  for (size_t i = 0; i < probability_.size(); ++i) {
    probability_[i] = float(std::exp2(-double(i) / FrameCodes::kBitSteps));
  }
}

bool CodeNovelty::add(const uint16_t* codes, const float* predicted_bits, float* bits) {
  const size_t groups = codes_.groups, entries = codes_.entries;
  double of_frame = 0, by_unigrams = 0;
  for (size_t cell = 0; cell < codes_.cells(); ++cell) {
    float sum = 0;
    for (size_t group = 0; group < groups; ++group) {
      const size_t i = cell * groups + group, code = codes[i];
      const float rare = float(codes_.unigram_bits[group * entries + code]) / FrameCodes::kBitSteps;
      by_unigrams += double(rare);
      if (!has_frame_) {
        sum += rare;
        continue;
      }
      const float moves = predicted_bits != nullptr
                              ? std::exp2(-predicted_bits[i])
                              : probability_[codes_.bigram_bits[(group * entries + before_[i]) * entries + code]];
      const float stays = codes[i] == before_[i] ? stays_[i] : 0.0f;
      const float likely = std::min(1.0f, stays + (1 - stays_[i]) * moves);
      sum -= std::log2(likely);
      stays_[i] = kReturns + (1 - 2 * kReturns) * (stays / likely);
    }
    bits[cell] = sum / float(groups);
    of_frame += double(sum);
  }
  const bool is_cut = has_frame_ && of_frame >= by_unigrams;
  if (!has_frame_ || is_cut) std::fill(stays_.begin(), stays_.end(), kStaysAtFirst);
  std::copy_n(codes, before_.size(), before_.begin());
  has_frame_ = true;
  return is_cut;
}

}  // namespace maq
