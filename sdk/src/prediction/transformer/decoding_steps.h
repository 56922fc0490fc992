// Decodes frames cell after cell: the masked network sees one cell at a time and keeps keys and values of the earlier
// cells.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "nn/session.h"
#include "prediction/transformer/embedding_sums.h"
#include "prediction/transformer/transformer_bundle.h"

namespace maq {

// For several samples at once, each with its own frame.
class DecodingSteps {
 public:
  // `bias` [layers][heads][cells][cells], and `parts`, must outlive this. Throws the exceptions of Session.
  DecodingSteps(const std::shared_ptr<const OnnxRuntimeLibrary>& runtime, const TransformerBundle& parts,
                const std::vector<float>& bias, size_t samples, SessionSettings settings);

  size_t samples() const { return rows_.size(); }

  // Begins a frame and forgets the one before.
  void begin();
  // Runs the masked network on the next cell, after begin() on the first. `context`: [cells][width] per sample. Throws
  // the exceptions of Session::run().
  void run(size_t cell, const float* const* context);
  // Returns the logits of group `k` of that cell, [samples][entries], valid until the next call. `codes`: [groups] per
  // sample, of which the ones before `k` are read.
  const float* logits(size_t k, const uint16_t* const* codes);
  // Sets all codes of the cell: [groups] per sample.
  void set(size_t cell, const uint16_t* const* codes);

  // Fills the kept keys and values, to test that later cells are masked.
  void fill_kept(float value);

 private:
  const TransformerBundle& parts_;
  const std::vector<float>& bias_;
  std::unique_ptr<Session> masked_;
  std::vector<std::unique_ptr<Session>> heads_;
  std::vector<GroupEmbeddings> rows_;  // by sample
  // Per layer: [samples][heads][cells][head_width]; row_bias_: [heads][1][cells + 1].
  std::vector<std::vector<float>> keys_, values_, row_bias_;
  std::vector<float> context_, near_, earlier_;
  std::vector<TensorView> masked_inputs_, head_inputs_;
  std::vector<Shape> masked_outputs_, head_outputs_;
};

}  // namespace maq
