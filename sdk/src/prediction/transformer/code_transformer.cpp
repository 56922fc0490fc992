#include "prediction/transformer/code_transformer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "prediction/transformer/code_likelihood.h"

namespace maq {
CodeTransformer::CodeTransformer(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const CodeBundle& bundle,
                                 const SessionSettings& settings)
    : runtime_(std::move(runtime)),
      parts_(bundle),
      settings_(settings),
      rows_(parts_.tables),
      bias_(causal_bias(parts_.tables)) {
  const TransformerTables& tables = parts_.tables;
  const auto places = int64_t(tables.places()), width = int64_t(tables.width), embedding = int64_t(tables.embedding),
             heads = int64_t(tables.heads), of_head = int64_t(parts_.head_width), entries = int64_t(tables.entries);
  SessionSettings whole = settings;
  whole.fixed_sizes = {{"samples", 1}, {"rows", places}, {"kept", 0}, {"kept_and_rows", places}};
  context_ = parts_.context.open(runtime_, settings);
  slices_ = parts_.slices.open(runtime_, whole);
  for (const TransformerBundle::Graph& head : parts_.heads) heads_.push_back(head.open(runtime_, whole));

  summed_.resize(tables.places() * tables.embedding);
  near_.resize(tables.places() * kNearCodes * tables.embedding);
  earlier_.resize(tables.places() * tables.width);
  logits_.resize(tables.entries);
  context_inputs_ = {{summed_.data(), {1, places, embedding}}, {&time_step_, {1, 1}}};
  context_outputs_ = {{1, places, width}};
  slice_inputs_ = {{nullptr, {1, places, width}}, {near_.data(), {1, places, int64_t(kNearCodes) * embedding}}};
  slice_outputs_ = {{1, places, width}};
  for (size_t layer = 0; layer < tables.layers; ++layer) {
    // No key is kept; where the memory of none lies does not matter.
    for (int i = 0; i < 2; ++i) slice_inputs_.push_back({bias_.data(), {1, heads, 0, of_head}});
    const size_t of_layer = tables.heads * tables.places() * tables.places();
    slice_inputs_.push_back({bias_.data() + layer * of_layer, {heads, places, places}});
    for (int i = 0; i < 2; ++i) slice_outputs_.push_back({1, heads, places, of_head});
  }
  head_inputs_ = {{nullptr, {1, places, width}}, {earlier_.data(), {1, places, width}}};
  head_outputs_ = {{1, places, entries}};
}

void CodeTransformer::see_context(const CodesBefore& before) {
  sum_context_rows(parts_.tables, before.frames, summed_.data());
  const float fps = before.step_s > 0 ? 1 / before.step_s : parts_.max_fps;
  time_step_ = std::log2(10 / std::clamp(fps, parts_.min_fps, parts_.max_fps));
  slice_inputs_[0].data = context_->run(context_inputs_, context_outputs_)[0].data;
}

void CodeTransformer::add_prior(size_t slice, uint16_t code_before, const float* logits) {
  const FrameCodes& stored = *parts_.codes;
  std::copy_n(logits, stored.entries, logits_.data());
  add_stored_prior(stored.after_bits.data() + (slice * stored.entries + code_before) * stored.entries, stored.entries,
                   logits_.data());
}

void CodeTransformer::see_places(const uint16_t* codes) {
  const TransformerTables& tables = parts_.tables;
  for (size_t place = 0; place < tables.places(); ++place) rows_.set(place, codes + place * tables.slices);
  for (size_t place = 0; place < tables.places(); ++place) {
    rows_.near(place, near_.data() + place * kNearCodes * tables.embedding);
  }
  head_inputs_[0].data = slices_->run(slice_inputs_, slice_outputs_)[0].data;
}

const float* CodeTransformer::head_logits(size_t slice, const uint16_t* codes) {
  const TransformerTables& tables = parts_.tables;
  for (size_t place = 0; place < tables.places(); ++place) {
    sum_earlier_rows(tables, slice, codes + place * tables.slices, earlier_.data() + place * tables.width);
  }
  return heads_[slice]->run(head_inputs_, head_outputs_)[0].data;
}

void CodeTransformer::bits(const CodesBefore& before, const uint16_t* codes, float* bits) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const TransformerTables& tables = parts_.tables;
  see_context(before);
  see_places(codes);
  for (size_t k = 0; k < tables.slices; ++k) {
    const float* logits = head_logits(k, codes);
    for (size_t place = 0; place < tables.places(); ++place, logits += tables.entries) {
      const size_t i = place * tables.slices + k;
      add_prior(k, before.newest[i], logits);
      bits[i] = bits_of_code(logits_.data(), tables.entries, codes[i]);
      if (std::isnan(bits[i])) {
        throw Error(MAQ_ERROR_INFERENCE, "The transformer gave NaN. Install the bundle again.");
      }
    }
  }
}

uint16_t CodeTransformer::draw_code(CodeSampler& sampler, const DrawPosition& position, float* entropy) const {
  if (entropy != nullptr) *entropy = entropy_bits(logits_.data(), logits_.size());
  return sampler.draw(logits_.data(), position);
}

size_t CodeTransformer::draw_in_passes(const CodesBefore& before, CodeSampler& sampler, const DrawPosition& first,
                                       size_t passes, uint16_t* codes, float* entropy) {
  const TransformerTables& tables = parts_.tables;
  const uint16_t* const by_motion = has_motion() ? before.frames[tables.before] : nullptr;
  std::copy_n(by_motion != nullptr ? by_motion : before.newest, tables.places() * tables.slices, codes);
  bool is_other = true;
  size_t pass = 0;
  for (; pass < passes && is_other; ++pass) {
    is_other = false;
    see_places(codes);
    DrawPosition at = first;
    for (size_t k = 0; k < tables.slices; ++k) {
      at.slice = uint16_t(k);
      const float* logits = head_logits(k, codes);
      for (size_t place = 0; place < tables.places(); ++place, logits += tables.entries) {
        const size_t i = place * tables.slices + k;
        at.place = uint32_t(place);
        add_prior(k, before.newest[i], logits);
        const uint16_t code = draw_code(sampler, at, entropy == nullptr ? nullptr : entropy + i);
        is_other |= code != codes[i];
        codes[i] = code;
      }
    }
  }
  return pass;
}

void CodeTransformer::draw_in_steps(const std::vector<CodesBefore>& before, CodeSampler& sampler,
                                    const DrawPosition& first, float* entropy) {
  const TransformerTables& tables = parts_.tables;
  const size_t samples = before.size(), of_frame = tables.places() * tables.slices,
               of_context = tables.places() * tables.width;
  if (steps_ == nullptr || steps_->samples() != samples) {
    steps_ = nullptr;
    steps_ = std::make_unique<PlaceSteps>(runtime_, parts_, bias_, samples, settings_);
  }
  contexts_.resize(samples * of_context);
  std::array<const float*, kMaxSamples> context;
  for (size_t s = 0; s < samples; ++s) {
    context[s] = s == 0 ? nullptr : context[s - 1];
    if (s > 0 && before[s].frames == before[s - 1].frames && before[s].step_s == before[s - 1].step_s) continue;
    see_context(before[s]);
    const float* const seen = slice_inputs_[0].data;
    context[s] = std::copy_n(seen, of_context, contexts_.data() + s * of_context) - of_context;
  }
  std::array<const uint16_t*, kMaxSamples> codes;
  DrawPosition at = first;
  steps_->begin();
  for (size_t place = 0; place < tables.places(); ++place) {
    at.place = uint32_t(place);
    steps_->see(place, context.data());
    for (size_t s = 0; s < samples; ++s) codes[s] = drawn_.data() + s * of_frame + place * tables.slices;
    for (size_t k = 0; k < tables.slices; ++k) {
      at.slice = uint16_t(k);
      const float* logits = steps_->logits(k, codes.data());
      for (size_t s = 0; s < samples; ++s, logits += tables.entries) {
        const size_t of_code = place * tables.slices + k, i = s * of_frame + of_code;
        at.sample = uint16_t(s);
        add_prior(k, before[s].newest[of_code], logits);
        drawn_[i] = draw_code(sampler, at, entropy == nullptr ? nullptr : entropy + i);
      }
    }
    steps_->set(place, codes.data());
  }
}

DrawCounts CodeTransformer::draw(const std::vector<CodesBefore>& before, const SamplingSettings& sampling,
                                 uint32_t stream, uint32_t frame, size_t passes, uint16_t* codes, float* entropy) {
  CodeSampler sampler(sampling, parts_.tables.entries);
  const std::lock_guard<std::mutex> lock(mutex_);
  const size_t of_frame = parts_.tables.places() * parts_.tables.slices;
  DrawPosition at;
  at.stream = stream;
  at.frame = frame;
  drawn_.resize(before.size() * of_frame);
  DrawCounts counts;
  if (passes == 0) {
    draw_in_steps(before, sampler, at, entropy);
    counts.steps = parts_.tables.places();
  } else {
    for (size_t s = 0; s < before.size(); ++s) {
      at.sample = uint16_t(s);
      see_context(before[s]);
      counts.passes += draw_in_passes(before[s], sampler, at, passes, drawn_.data() + s * of_frame,
                                      entropy == nullptr ? nullptr : entropy + s * of_frame);
    }
  }
  std::copy(drawn_.begin(), drawn_.end(), codes);
  return counts;
}

}  // namespace maq
