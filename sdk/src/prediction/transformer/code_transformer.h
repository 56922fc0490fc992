// Probabilities of the codes of a frame, given the context frames and the earlier codes of the frame: the Latent Video
// Transformer (Rakhimov et al., VISAPP 2021, arXiv 2006.10704).
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "nn/session.h"
#include "prediction/transformer/code_sampler.h"
#include "prediction/transformer/decoding_steps.h"
#include "prediction/transformer/embedding_sums.h"
#include "prediction/transformer/transformer_bundle.h"

namespace maq {

// The context of a frame.
struct CodesBefore {
  ContextFrames frames{};
  const uint16_t* newest = nullptr;  // of the stream, for the bigram prior; not null
  float step_s = 0;                  // from the newest frame to this one; clamped to the steps in training
};

// Shared by streams, from any thread; frames are processed one after another.
class CodeTransformer {
 public:
  // `settings.threads` is a number. The bundle is not needed afterwards. Throws the exceptions of TransformerBundle and
  // Session.
  CodeTransformer(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const CodeBundle& bundle,
                  const SessionSettings& settings);

  size_t before() const { return parts_.tables.before; }  // context frames of the stream
  bool has_motion() const { return parts_.tables.has_motion(); }

  // Writes -log2 of the probability of each code of a frame; `codes` and `bits` are [cells][groups]. Throws
  // MAQ_ERROR_INFERENCE, also when a network returns NaN; `bits` is then undefined.
  void bits(const CodesBefore& before, const uint16_t* codes, float* bits);

  // Samples the codes of 1 to kMaxSamples frames, each after its own context, cell after cell, into `codes`,
  // [samples][cells][groups]. A sample does not depend on the others. `stream` and `frame` select its random numbers.
  // Writes the entropy of each code in bits to `entropy` unless it is null. Throws the exceptions of bits() and
  // CodeSampler, and MAQ_CANCELLED when `cancel` is true, which it then resets; `codes` is then unchanged.
  static constexpr size_t kMaxSamples = 16;
  void sample(const std::vector<CodesBefore>& before, const SamplingSettings& sampling, uint32_t stream, uint32_t frame,
              std::atomic<bool>& cancel, uint16_t* codes, float* entropy);

 private:
  void run_context(const CodesBefore& before);
  // Runs the masked network on all cells of a known frame. head_logits() then returns [cells][entries].
  void run_masked(const uint16_t* codes);
  const float* head_logits(size_t group, const uint16_t* codes);
  // Points `contexts` at the context features of each sample, [cells][width]; equal contexts are computed once.
  void run_contexts(const std::vector<CodesBefore>& before, const float** contexts);
  void sample_cell(const std::vector<CodesBefore>& before, CodeSampler& sampler, SamplePosition at, float* entropy);
  // Writes a head's logits plus the bigram prior, given the cell's code before, to logits_.
  void add_prior(size_t group, uint16_t code_before, const float* logits);

  const std::shared_ptr<const OnnxRuntimeLibrary> runtime_;
  const TransformerBundle parts_;
  const SessionSettings settings_;
  std::unique_ptr<Session> context_, masked_;
  std::vector<std::unique_ptr<Session>> heads_;

  std::mutex mutex_;  // guards the members below and the sessions
  GroupEmbeddings embeddings_;
  std::unique_ptr<DecodingSteps> steps_;  // for as many samples as the latest call had
  std::vector<uint16_t> sampled_;
  std::vector<float> contexts_;  // of samples with different contexts
  // [layers][heads][cells][cells], as causal_bias() returns it.
  std::vector<float> bias_;
  std::vector<float> summed_, near_, earlier_, logits_;
  float time_step_ = 0;
  std::vector<TensorView> context_inputs_, masked_inputs_, head_inputs_;
  std::vector<Shape> context_outputs_, masked_outputs_, head_outputs_;
};

}  // namespace maq
