// Runs a pipeline with a frame budget, on a processor that benchmarks/frame_budget.py throttles.
//
//   measure_frame_budget DENSEPOSE_BUNDLE URI BUDGET_MS LABELS
//
// maps every frame of a source, which must not be live, with that budget (0: none) on one thread. Prints a JSON list
// with an entry for each frame: milliseconds of the model, long side of the networks' input, and whether it was a key
// frame. Writes the body part of each pixel, a byte, frame after frame, to the file LABELS.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <future>
#include <maquette/maquette.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

struct Mapped {
  double run_ms;
  int32_t long_side_px, is_key_frame;
};

struct Run {
  std::vector<Mapped> frames;
  std::ofstream labels;
  std::promise<std::string> end;  // why there are no more frames, "" after the last

  void take(const maquette::PipelineResult& result) {
    const maquette::DensePoseResult densepose = maquette::densepose_of(result);
    const maq_densepose_stats stats = densepose.stats();
    frames.push_back({result.run_ms, std::max(stats.network_width_px, stats.network_height_px), stats.is_key_frame});
    size_t stride = 0;
    const uint8_t* const parts = densepose.plane(MAQ_DENSEPOSE_PLANE_PART, &stride);
    for (int y = 0; y < densepose.height_px(); ++y) {
      labels.write(reinterpret_cast<const char*>(parts + size_t(y) * stride), densepose.width_px());
    }
  }
};

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 5) throw std::runtime_error("arguments: DENSEPOSE_BUNDLE URI BUDGET_MS LABELS");
  const maquette::Context context;
  maq_densepose_config model = maquette::default_densepose_config();
  model.model.bundle_path = argv[1];
  model.model.threads = 1;
  Run run;
  run.labels.open(argv[4], std::ios::binary);
  maq_pipeline_config config = maquette::default_pipeline_config();
  config.result_user_data = config.state_user_data = &run;
  config.result_callback = [](void* to, maq_pipeline_result* result) {
    static_cast<Run*>(to)->take(maquette::PipelineResult(result));
  };
  config.state_callback = [](void* to, maq_pipeline_state state, maq_status, const char* why) {
    if (state == MAQ_PIPELINE_ENDED || state == MAQ_PIPELINE_FAILED) static_cast<Run*>(to)->end.set_value(why);
  };
  maquette::Pipeline pipeline(context, config);
  maquette::DensePoseModel people(context, model);
  people.set_frame_budget(std::atof(argv[3]));
  pipeline.set_model(people);
  pipeline.set_source(argv[2]);
  const std::string problem = run.end.get_future().get();
  if (!problem.empty()) throw std::runtime_error(problem);
  if (!run.labels.flush()) throw std::runtime_error(std::string(argv[4]) + " cannot be written");
  const char* separator = "[";
  for (const Mapped& frame : run.frames) {
    std::printf("%s[%.3f, %d, %d]", separator, frame.run_ms, frame.long_side_px, frame.is_key_frame);
    separator = ",\n ";
  }
  std::puts("]");
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "measure_frame_budget: %s\n", error.what());
  return 1;
}
