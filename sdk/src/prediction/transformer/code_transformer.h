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

  // Draws the codes of `samples` frames, 1 to kMaxSamples, place after place and so exactly by what the network says:
  // [samples][places][slices]. `stream` and `frame` count their random numbers. Throws what bits() throws, and what
  // CodeSampler throws; `codes` are then as before.
  static constexpr size_t kMaxSamples = 16;
  void draw(const CodesBefore& before, const SamplingSettings& sampling, uint32_t stream, uint32_t frame,
            size_t samples, uint16_t* codes);

 private:
  void see_context(const CodesBefore& before);
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
  // [layers][heads][places][places]: added to the score of a query and a key, -infinity for keys after the query.
  std::vector<float> bias_;
  std::vector<float> summed_, near_, earlier_, logits_;
  float time_step_ = 0;
  std::vector<TensorView> context_inputs_, slice_inputs_, head_inputs_;
  std::vector<Shape> context_outputs_, slice_outputs_, head_outputs_;
};

}  // namespace maq
