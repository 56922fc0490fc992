// A frame that is made place after place: the slice network sees one place at a time, and the keys and values of those
// before are kept.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "nn/session.h"
#include "prediction/transformer/row_sums.h"
#include "prediction/transformer/transformer_bundle.h"

namespace maq {

// Of some samples at once, each a frame of its own.
class PlaceSteps {
 public:
  // `bias` [layers][heads][places][places], and `parts`, must outlive this. Throws what Session throws.
  PlaceSteps(const std::shared_ptr<const OnnxRuntimeLibrary>& runtime, const TransformerBundle& parts,
             const std::vector<float>& bias, size_t samples, SessionSettings settings);

  size_t samples() const { return rows_.size(); }

  // A frame begins: nothing of the one before is known.
  void begin();
  // Sees the next place, after begin() the first one. `context`: of each sample, [places][width]. Throws what
  // Session::run() throws.
  void see(size_t place, const float* const* context);
  // Logits of slice `k` of that place, [samples][entries], in memory that stays until the next call. `codes`: of each
  // sample [slices], of which those before `k` are known.
  const float* logits(size_t k, const uint16_t* const* codes);
  // All codes of the place are known: [slices] of each sample.
  void set(size_t place, const uint16_t* const* codes);

  // Fills what is kept with a number, to try that nothing of it is seen.
  void fill_kept(float value);

 private:
  const TransformerBundle& parts_;
  const std::vector<float>& bias_;
  std::unique_ptr<Session> slices_;
  std::vector<std::unique_ptr<Session>> heads_;
  std::vector<SliceRows> rows_;  // by sample
  // Of each layer [samples][heads][places][head_width], of the slice network's bias [heads][1][places + 1].
  std::vector<std::vector<float>> keys_, values_, row_bias_;
  std::vector<float> context_, near_, earlier_;
  std::vector<TensorView> slice_inputs_, head_inputs_;
  std::vector<Shape> slice_outputs_, head_outputs_;
};

}  // namespace maq
