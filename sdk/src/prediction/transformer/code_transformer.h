// How likely each code of a frame is, given those of the frames before and those before it in the frame: the Latent
// Video Transformer (Rakhimov et al., VISAPP 2021, arXiv 2006.10704).
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "nn/session.h"
#include "prediction/transformer/code_sampler.h"
#include "prediction/transformer/place_steps.h"
#include "prediction/transformer/row_sums.h"
#include "prediction/transformer/transformer_bundle.h"

namespace maq {

// What a frame is foreseen from.
struct CodesBefore {
  ContextFrames frames{};
  const uint16_t* newest = nullptr;  // of the stream, which the table of what follows which code goes by; not null
  float step_s = 0;                  // from that to the frame; the nearest that the network knows is taken
};

// How often networks ran for frames that were drawn.
struct DrawCounts {
  size_t steps = 0;   // for a place each, of all samples at once
  size_t passes = 0;  // for all places of a frame
};

// For several streams, from any thread: their frames are seen one after another.
class CodeTransformer {
 public:
  // `settings.threads` is a number. The bundle is not needed afterwards. Throws what TransformerBundle and Session
  // throw.
  CodeTransformer(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const CodeBundle& bundle,
                  const SessionSettings& settings);

  size_t before() const { return parts_.tables.before; }  // frames of the stream that are seen
  bool has_motion() const { return parts_.tables.has_motion(); }

  // -log2 of the probability of each code of a frame, [places][slices], as are `codes`. Throws MAQ_ERROR_INFERENCE,
  // also where a network gives NaN; `bits` are then of no use.
  void bits(const CodesBefore& before, const uint16_t* codes, float* bits);

  // Draws the codes of 1 to kMaxSamples frames, each after its own `before`: [samples][places][slices]. `passes` is 0:
  // place after place, and so exactly by what the network says. Else all places at once, at most so many times, each
  // time after those that were drawn the time before, at first what motion foresees: after a pass that changes nothing
  // they are those of place after place (Song et al., "Accelerating feedforward computation via parallel nonlinear
  // equation solving", ICML 2021). A sample does not depend on the others. `stream` and `frame` count their random
  // numbers. `entropy`, unless null: of each code's probabilities, in bits. Throws what bits() throws, and what
  // CodeSampler throws; `codes` are then as before.
  static constexpr size_t kMaxSamples = 16, kMaxPasses = 16;
  DrawCounts draw(const std::vector<CodesBefore>& before, const SamplingSettings& sampling, uint32_t stream,
                  uint32_t frame, size_t passes, uint16_t* codes, float* entropy);

 private:
  void see_context(const CodesBefore& before);
  // All places at once: features of a frame's codes for head_logits(), which gives [places][entries].
  void see_places(const uint16_t* codes);
  const float* head_logits(size_t slice, const uint16_t* codes);
  // By logits_, which are known.
  uint16_t draw_code(CodeSampler& sampler, const DrawPosition& position, float* entropy) const;
  // How many there were.
  size_t draw_in_passes(const CodesBefore& before, CodeSampler& sampler, const DrawPosition& first, size_t passes,
                        uint16_t* codes, float* entropy);
  void draw_in_steps(const std::vector<CodesBefore>& before, CodeSampler& sampler, const DrawPosition& first,
                     float* entropy);
  // Logits of a head, with the table by the code that the place had before, into logits_.
  void add_prior(size_t slice, uint16_t code_before, const float* logits);

  const std::shared_ptr<const OnnxRuntimeLibrary> runtime_;
  const TransformerBundle parts_;
  const SessionSettings settings_;
  std::unique_ptr<Session> context_, slices_;
  std::vector<std::unique_ptr<Session>> heads_;

  std::mutex mutex_;  // of what follows, and of the sessions
  SliceRows rows_;
  std::unique_ptr<PlaceSteps> steps_;  // of as many samples as were drawn latest
  std::vector<uint16_t> drawn_;
  std::vector<float> contexts_;  // of samples whose frames before differ
  // [layers][heads][places][places]: added to the score of a query and a key, -infinity for keys after the query.
  std::vector<float> bias_;
  std::vector<float> summed_, near_, earlier_, logits_;
  float time_step_ = 0;
  std::vector<TensorView> context_inputs_, slice_inputs_, head_inputs_;
  std::vector<Shape> context_outputs_, slice_outputs_, head_outputs_;
};

}  // namespace maq
