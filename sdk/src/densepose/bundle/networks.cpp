#include "densepose/bundle/networks.h"

#include <utility>

#include "core/error.h"
#include "densepose/bundle/manifest.h"

namespace maq {

DensePoseNetworks::DensePoseNetworks(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const Bundle& bundle,
                                     int threads, maq_provider provider)
    : runtime_(std::move(runtime)), bundle_(bundle) {
  on_cpu_.threads = on_provider_.threads = threads;
  on_provider_.provider = provider;
}

std::unique_ptr<Session> DensePoseNetworks::open(const std::string& name, GraphSpec graph,
                                                 const std::vector<int64_t>& input,
                                                 const std::vector<std::vector<int64_t>>& outputs,
                                                 const SessionSettings& with) const {
  require_shapes(graph, input, outputs, concatenate("Bundle ", bundle_.manifest.name, ": graph ", name, ": "));
  return open_session(runtime_, bundle_.files.at(graph.file), graph, bundle_.path_of(graph.file), with);
}

}  // namespace maq
