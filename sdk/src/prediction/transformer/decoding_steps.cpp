#include "prediction/transformer/decoding_steps.h"

#include <algorithm>
#include <limits>

namespace maq {

DecodingSteps::DecodingSteps(const std::shared_ptr<const OnnxRuntimeLibrary>& runtime, const TransformerBundle& parts,
                             const std::vector<float>& bias, size_t samples, SessionSettings settings)
    : parts_(parts), bias_(bias), rows_(samples, GroupEmbeddings(parts.tables)) {
  const TransformerTables& tables = parts.tables;
  const auto cells = int64_t(tables.cells()), count = int64_t(samples), width = int64_t(tables.width),
             heads = int64_t(tables.heads), of_head = int64_t(parts.head_width),
             near = int64_t(kNearCodes * tables.embedding);
  settings.threads = 1;  // one cell is too little work for more
  settings.fixed_sizes = {{"samples", count}, {"rows", 1}, {"kept", cells}, {"kept_and_rows", cells + 1}};
  masked_ = parts.masked.open(runtime, settings);
  for (const TransformerBundle::Graph& head : parts.heads) heads_.push_back(head.open(runtime, settings));

  context_.resize(samples * tables.width);
  near_.resize(samples * kNearCodes * tables.embedding);
  earlier_.resize(samples * tables.width);
  keys_.assign(tables.layers, std::vector<float>(samples * tables.heads * tables.cells() * parts.head_width));
  values_ = keys_;
  row_bias_.assign(tables.layers, std::vector<float>(tables.heads * (tables.cells() + 1)));
  masked_inputs_ = {{context_.data(), {count, 1, width}}, {near_.data(), {count, 1, near}}};
  masked_outputs_ = {{count, 1, width}};
  for (size_t layer = 0; layer < tables.layers; ++layer) {
    masked_inputs_.push_back({keys_[layer].data(), {count, heads, cells, of_head}});
    masked_inputs_.push_back({values_[layer].data(), {count, heads, cells, of_head}});
    masked_inputs_.push_back({row_bias_[layer].data(), {heads, 1, cells + 1}});
    for (int i = 0; i < 2; ++i) masked_outputs_.push_back({count, heads, 1, of_head});
  }
  head_inputs_ = {{nullptr, {count, 1, width}}, {earlier_.data(), {count, 1, width}}};
  head_outputs_ = {{count, 1, int64_t(tables.entries)}};
}

void DecodingSteps::fill_kept(float value) {
  for (std::vector<std::vector<float>>* const kept : {&keys_, &values_}) {
    for (std::vector<float>& of_layer : *kept) std::fill(of_layer.begin(), of_layer.end(), value);
  }
}

void DecodingSteps::begin() {
  // Later cells have weight 0, and 0 times a number must be 0.
  fill_kept(0);
  for (std::vector<float>& row : row_bias_) std::fill(row.begin(), row.end(), -std::numeric_limits<float>::infinity());
}

void DecodingSteps::run(size_t cell, const float* const* context) {
  const TransformerTables& tables = parts_.tables;
  const size_t cells = tables.cells(), of_head = parts_.head_width;
  for (size_t sample = 0; sample < samples(); ++sample) {
    std::copy_n(context[sample] + cell * tables.width, tables.width, context_.data() + sample * tables.width);
    rows_[sample].near(cell, near_.data() + sample * kNearCodes * tables.embedding);
  }
  for (size_t layer = 0; layer < tables.layers; ++layer) {
    for (size_t head = 0; head < tables.heads; ++head) {
      const float* const of_place = bias_.data() + ((layer * tables.heads + head) * cells + cell) * cells;
      float* const row = row_bias_[layer].data() + head * (cells + 1);
      std::copy_n(of_place, cell, row);
      row[cells] = of_place[cell];
    }
  }
  const std::vector<TensorView>& found = masked_->run(masked_inputs_, masked_outputs_);
  head_inputs_[0].data = found[0].data;
  for (size_t layer = 0; layer < tables.layers; ++layer) {
    for (size_t row = 0; row < samples() * tables.heads; ++row) {
      const size_t at = (row * cells + cell) * of_head;
      std::copy_n(found[1 + 2 * layer].data + row * of_head, of_head, keys_[layer].data() + at);
      std::copy_n(found[2 + 2 * layer].data + row * of_head, of_head, values_[layer].data() + at);
    }
  }
}

const float* DecodingSteps::logits(size_t k, const uint16_t* const* codes) {
  const size_t width = parts_.tables.width;
  for (size_t sample = 0; sample < samples(); ++sample) {
    sum_earlier_embeddings(parts_.tables, k, codes[sample], earlier_.data() + sample * width);
  }
  return heads_[k]->run(head_inputs_, head_outputs_)[0].data;
}

void DecodingSteps::set(size_t cell, const uint16_t* const* codes) {
  for (size_t sample = 0; sample < samples(); ++sample) rows_[sample].set(cell, codes[sample]);
}

}  // namespace maq
