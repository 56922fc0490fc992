// Saves the predicted frame of a camera or clip while it plays: predict video:clip.mp4 later.png [<seconds ahead>].
// Predicted frames are guesses: never steer anything by them.
#include <cstdio>
#include <cstdlib>
#include <maquette/maquette.hpp>

int main(int argc, char** argv) try {
  if (argc < 3) {
    std::fprintf(stderr, "usage: predict <source> <image> [<seconds ahead>]\n");
    return 2;
  }
  const double ahead_s = argc > 3 ? std::atof(argv[3]) : 0.1;
  const maquette::Context context;
  maquette::Pipeline pipeline(context);
  pipeline.set_model(maquette::PredictionModel(context, maquette::Predictor(context), ahead_s, true));
  pipeline.set_source(argv[1]);
  unsigned long long events = 0;
  while (const auto result = pipeline.next()) {
    maquette::predicted_frame_of(*result)->save(argv[2]);  // with a mark in the file
    events += maquette::camera_health_of(*result)->event != MAQ_CAMERA_OK ? 1 : 0;
  }
  std::printf("%.0f ms ahead, %llu events\n", 1e3 * ahead_s, events);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
