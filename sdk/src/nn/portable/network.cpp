#include "nn/portable/network.h"

#include <utility>

#include "core/error.h"

namespace maq {

PortableNetwork::PortableNetwork(NetworkPlan plan) : plan_(std::move(plan)), tensors_(plan_.is_float.size()) {
  plan_memory();
}

void PortableNetwork::plan_memory() {
  const size_t steps = plan_.steps.size();
  std::vector<size_t> last_use(tensors_.size(), 0);
  for (size_t i = 0; i < steps; ++i) {
    for (const int input : plan_.steps[i].inputs) last_use[size_t(input)] = i;
  }
  memory_of_.assign(tensors_.size(), -1);
  std::vector<bool> is_callers(tensors_.size(), false);
  for (const std::vector<int>* side : {&plan_.inputs, &plan_.outputs}) {
    for (const int tensor : *side) is_callers[size_t(tensor)] = true;
  }
  std::vector<int> free;
  for (size_t i = 0; i < steps; ++i) {
    const Step& step = plan_.steps[i];
    if (!is_callers[size_t(step.output)]) {
      if (free.empty()) {
        free.push_back(int(memories_.size()));
        memories_.emplace_back();
      }
      memory_of_[size_t(step.output)] = free.back();
      free.pop_back();
    }
    for (size_t tensor = 0; tensor < tensors_.size(); ++tensor) {
      if (last_use[tensor] == i && memory_of_[tensor] >= 0 && int(tensor) != step.output) {
        free.push_back(memory_of_[tensor]);
        last_use[tensor] = steps;  // given back once
      }
    }
  }
}

void PortableNetwork::run(const std::vector<Tensor>& inputs, const std::vector<Tensor>& outputs,
                          WorkerThreads& threads) {
  for (size_t i = 0; i < plan_.inputs.size(); ++i) tensors_[size_t(plan_.inputs[i])] = inputs[i];
  for (size_t i = 0; i < plan_.outputs.size(); ++i) tensors_[size_t(plan_.outputs[i])] = outputs[i];
  for (const Step& step : plan_.steps) {
    step_inputs_.clear();
    for (const int input : step.inputs) step_inputs_.push_back(&tensors_[size_t(input)]);
    const Extents extents = step.layer->output_extents(step_inputs_);
    const size_t number = size_t(step.output);
    Tensor& output = tensors_[number];
    if (memory_of_[number] >= 0) {
      const bool is_float = plan_.is_float[number];
      const size_t bytes = count_of(extents) * (is_float ? sizeof(float) : sizeof(int16_t));
      std::vector<unsigned char>& memory = memories_[size_t(memory_of_[number])];
      if (memory.size() < bytes) memory = std::vector<unsigned char>(bytes);
      output.extents = extents;
      if (is_float) {
        output.floats = reinterpret_cast<float*>(memory.data());
      } else {
        output.quantized = reinterpret_cast<int16_t*>(memory.data());
      }
    } else if (output.extents != extents) {
      throw Error(MAQ_ERROR_INFERENCE, "An output has the shape [", extents[0], ", ", extents[1], ", ", extents[2],
                  ", ", extents[3], "], but [", output.extents[0], ", ", output.extents[1], ", ", output.extents[2],
                  ", ", output.extents[3], "] is expected.");
    }
    step.layer->run(step_inputs_, output, threads);
  }
}

}  // namespace maq
