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
      embeddings_(parts_.tables),
      bias_(causal_bias(parts_.tables)) {
  const TransformerTables& tables = parts_.tables;
  const auto cells = int64_t(tables.cells()), width = int64_t(tables.width), embedding = int64_t(tables.embedding),
             heads = int64_t(tables.heads), of_head = int64_t(parts_.head_width), entries = int64_t(tables.entries);
  SessionSettings whole = settings;
  whole.fixed_sizes = {{"samples", 1}, {"rows", cells}, {"kept", 0}, {"kept_and_rows", cells}};
  context_ = parts_.context.open(runtime_, settings);
  masked_ = parts_.masked.open(runtime_, whole);
  for (const TransformerBundle::Graph& head : parts_.heads) heads_.push_back(head.open(runtime_, whole));

  summed_.resize(tables.cells() * tables.embedding);
  near_.resize(tables.cells() * kNearCodes * tables.embedding);
  earlier_.resize(tables.cells() * tables.width);
  logits_.resize(tables.entries);
  context_inputs_ = {{summed_.data(), {1, cells, embedding}}, {&time_step_, {1, 1}}};
  context_outputs_ = {{1, cells, width}};
  masked_inputs_ = {{nullptr, {1, cells, width}}, {near_.data(), {1, cells, int64_t(kNearCodes) * embedding}}};
  masked_outputs_ = {{1, cells, width}};
  for (size_t layer = 0; layer < tables.layers; ++layer) {
    // No key is kept, so the address of these empty tensors does not matter.
    for (int i = 0; i < 2; ++i) masked_inputs_.push_back({bias_.data(), {1, heads, 0, of_head}});
    const size_t of_layer = tables.heads * tables.cells() * tables.cells();
    masked_inputs_.push_back({bias_.data() + layer * of_layer, {heads, cells, cells}});
    for (int i = 0; i < 2; ++i) masked_outputs_.push_back({1, heads, cells, of_head});
  }
  head_inputs_ = {{nullptr, {1, cells, width}}, {earlier_.data(), {1, cells, width}}};
  head_outputs_ = {{1, cells, entries}};
}

void CodeTransformer::run_context(const CodesBefore& before) {
  sum_context_embeddings(parts_.tables, before.frames, summed_.data());
  const float fps = before.step_s > 0 ? 1 / before.step_s : parts_.max_fps;
  time_step_ = std::log2(10 / std::clamp(fps, parts_.min_fps, parts_.max_fps));
  masked_inputs_[0].data = context_->run(context_inputs_, context_outputs_)[0].data;
}

void CodeTransformer::add_prior(size_t group, uint16_t code_before, const float* logits) {
  const FrameCodes& stored = *parts_.codes;
  std::copy_n(logits, stored.entries, logits_.data());
  add_stored_prior(stored.bigram_bits.data() + (group * stored.entries + code_before) * stored.entries, stored.entries,
                   logits_.data());
}

void CodeTransformer::run_masked(const uint16_t* codes) {
  const TransformerTables& tables = parts_.tables;
  for (size_t cell = 0; cell < tables.cells(); ++cell) embeddings_.set(cell, codes + cell * tables.groups);
  for (size_t cell = 0; cell < tables.cells(); ++cell) {
    embeddings_.near(cell, near_.data() + cell * kNearCodes * tables.embedding);
  }
  head_inputs_[0].data = masked_->run(masked_inputs_, masked_outputs_)[0].data;
}

const float* CodeTransformer::head_logits(size_t group, const uint16_t* codes) {
  const TransformerTables& tables = parts_.tables;
  for (size_t cell = 0; cell < tables.cells(); ++cell) {
    sum_earlier_embeddings(tables, group, codes + cell * tables.groups, earlier_.data() + cell * tables.width);
  }
  return heads_[group]->run(head_inputs_, head_outputs_)[0].data;
}

void CodeTransformer::bits(const CodesBefore& before, const uint16_t* codes, float* bits) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const TransformerTables& tables = parts_.tables;
  run_context(before);
  run_masked(codes);
  for (size_t k = 0; k < tables.groups; ++k) {
    const float* logits = head_logits(k, codes);
    for (size_t cell = 0; cell < tables.cells(); ++cell, logits += tables.entries) {
      const size_t i = cell * tables.groups + k;
      add_prior(k, before.newest[i], logits);
      bits[i] = bits_of_code(logits_.data(), tables.entries, codes[i]);
      if (std::isnan(bits[i])) {
        throw Error(MAQ_ERROR_INFERENCE, "The transformer returned NaN. Install the bundle again.");
      }
    }
  }
}

void CodeTransformer::run_contexts(const std::vector<CodesBefore>& before, const float** contexts) {
  const size_t of_context = parts_.tables.cells() * parts_.tables.width;
  contexts_.resize(before.size() * of_context);
  for (size_t s = 0; s < before.size(); ++s) {
    contexts[s] = s == 0 ? nullptr : contexts[s - 1];
    if (s > 0 && before[s].frames == before[s - 1].frames && before[s].step_s == before[s - 1].step_s) continue;
    run_context(before[s]);
    const float* const features = masked_inputs_[0].data;
    contexts[s] = std::copy_n(features, of_context, contexts_.data() + s * of_context) - of_context;
  }
}

void CodeTransformer::sample_cell(const std::vector<CodesBefore>& before, CodeSampler& sampler, SamplePosition at,
                                  float* entropy) {
  const TransformerTables& tables = parts_.tables;
  const size_t samples = before.size(), of_frame = tables.cells() * tables.groups, cell = at.cell;
  std::array<const uint16_t*, kMaxSamples> codes;
  for (size_t s = 0; s < samples; ++s) codes[s] = sampled_.data() + s * of_frame + cell * tables.groups;
  for (size_t k = 0; k < tables.groups; ++k) {
    at.group = uint16_t(k);
    const float* logits = steps_->logits(k, codes.data());
    for (size_t s = 0; s < samples; ++s, logits += tables.entries) {
      const size_t of_code = cell * tables.groups + k, i = s * of_frame + of_code;
      at.sample = uint16_t(s);
      add_prior(k, before[s].newest[of_code], logits);
      if (entropy != nullptr) entropy[i] = entropy_bits(logits_.data(), logits_.size());
      sampled_[i] = sampler.sample(logits_.data(), at);
    }
  }
  steps_->set(cell, codes.data());
}

void CodeTransformer::sample(const std::vector<CodesBefore>& before, const SamplingSettings& sampling, uint32_t stream,
                             uint32_t frame, std::atomic<bool>& cancel, uint16_t* codes, float* entropy) {
  CodeSampler sampler(sampling, parts_.tables.entries);
  const std::lock_guard<std::mutex> lock(mutex_);
  const size_t samples = before.size(), cells = parts_.tables.cells();
  if (steps_ == nullptr || steps_->samples() != samples) {
    steps_ = nullptr;
    steps_ = std::make_unique<DecodingSteps>(runtime_, parts_, bias_, samples, settings_);
  }
  std::array<const float*, kMaxSamples> contexts;
  run_contexts(before, contexts.data());
  sampled_.resize(samples * cells * parts_.tables.groups);
  SamplePosition at;
  at.stream = stream;
  at.frame = frame;
  steps_->begin();
  for (size_t cell = 0; cell < cells; ++cell) {
    if (cancel.exchange(false)) throw Error(MAQ_CANCELLED, "Sampling was cancelled.");
    at.cell = uint32_t(cell);
    steps_->run(cell, contexts.data());
    sample_cell(before, sampler, at, entropy);
  }
  std::copy(sampled_.begin(), sampled_.end(), codes);
}

}  // namespace maq
