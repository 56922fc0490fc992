// Opens the networks of a bundle of dense pose.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "nn/bundle.h"
#include "nn/session.h"

namespace maq {

class DensePoseNetworks {
 public:
  // `bundle` must outlive this. `provider` is one that the runtime has.
  DensePoseNetworks(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const Bundle& bundle, int threads,
                    maq_provider provider);

  const std::shared_ptr<const OnnxRuntimeLibrary>& runtime() const { return runtime_; }
  const Bundle& bundle() const { return bundle_; }
  const SessionSettings& on_cpu() const { return on_cpu_; }
  const SessionSettings& on_provider() const { return on_provider_; }

  // Opens a graph of the manifest whose inputs and outputs must have these shapes. Throws MAQ_ERROR_BAD_BUNDLE.
  std::unique_ptr<Session> open(const std::string& name, GraphSpec graph, const std::vector<int64_t>& input,
                                const std::vector<std::vector<int64_t>>& outputs, const SessionSettings& with) const;

 private:
  std::shared_ptr<const OnnxRuntimeLibrary> runtime_;
  const Bundle& bundle_;
  SessionSettings on_cpu_, on_provider_;
};

}  // namespace maq
