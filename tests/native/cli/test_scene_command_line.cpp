// `maquette scene` as a person meets it, and as benchmarks/scenes/command.py does: files, figures, sentences, Ctrl-C.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <set>

#include "support/program_run.h"

namespace {

class SceneCommandLine : public ::testing::Test {
 protected:
  SceneCommandLine() { std::filesystem::create_directory_symlink(MAQ_TEST_DATA "/tiny_scene/capture", file("place")); }

  std::string file(const std::string& name) const { return folder_.file(name); }
  Outcome run(const std::string& arguments) const { return run_program(folder_, environment_, "scene " + arguments); }
  void build() const {
    const Outcome built = run("build place --out place.maqs");
    ASSERT_EQ(built.exit_code, 0) << built.err;
  }
  nlohmann::json json(const std::string& name) const { return nlohmann::json::parse(read_text(file(name))); }

  // Exit code 1, and the last line on standard error is one sentence with `text`.
  void expect_failure(const std::string& arguments, const std::string& text) const {
    const Outcome result = run(arguments);
    EXPECT_EQ(result.exit_code, 1) << arguments;
    const size_t last = result.err.rfind("maquette: ");
    ASSERT_NE(last, std::string::npos) << result.err;
    EXPECT_NE(result.err.find(text, last), std::string::npos) << result.err;
    EXPECT_EQ(result.err.find('\n', last), result.err.size() - 1) << result.err;
  }

  // Lists all files, hidden ones too: nothing may be left half made.
  std::set<std::string> files(const std::string& folder = "") const {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(file(folder))) {
      names.insert(entry.path().filename().string());
    }
    for (const char* own : {"out.txt", "err.txt", "place"}) names.erase(own);
    return names;
  }

  int frames_of(const std::string& name, int width_px, int height_px) const {
    cv::VideoCapture clip(file(name));
    cv::Mat frame;
    int frames = 0;
    while (clip.read(frame)) {
      EXPECT_EQ(frame.size(), cv::Size(width_px, height_px));
      ++frames;
    }
    return frames;
  }

  TempFolder folder_;
  std::string environment_ = "MAQ_SCENE_BUNDLE='" MAQ_TEST_DATA "/tiny_scene/bundle'";
};

TEST_F(SceneCommandLine, SaysWhatMakesASceneOfAFilmOrPlainPhotos) {
  const std::string command = "python -m maquette scene make film.mp4 --out place.maqs";
  expect_failure("make film.mp4 --out place.maqs", command);
  write_text(file("film.mp4"), "film");
  expect_failure("build film.mp4 --out room.maqs", command);
  std::filesystem::create_directory(file("photos"));
  expect_failure("build photos --out room.maqs", "python -m maquette scene make photos --out place.maqs");
  EXPECT_EQ(files(), (std::set<std::string>{"film.mp4", "photos"}));
}

TEST_F(SceneCommandLine, BuildsASceneWithTheFiguresThatTheBenchmarkReads) {
  const Outcome result = run("build place --out o/place.maqs --json o/build.json --ply o/place.ply");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err.rfind("place: 5 photos, ", 0), 0u) << result.err;
  EXPECT_NE(result.out.find("points were seen by 4 photos"), std::string::npos) << result.out;
  EXPECT_EQ(files("o"), (std::set<std::string>{"place.maqs", "build.json", "place.ply"}));
  const nlohmann::json figures = json("o/build.json");
  EXPECT_GT(figures.at("points"), 100);
  EXPECT_LE(figures.at("view_dependent_points"), figures.at("points"));
  EXPECT_EQ(figures.at("bytes"), std::filesystem::file_size(file("o/place.maqs")));
  EXPECT_GT(figures.at("peak_memory_mib"), 1);
  EXPECT_EQ(figures.at("views"), 4);
  EXPECT_EQ(figures.at("unused_views"), 0);
  double stages = 0;
  for (const char* stage : {"load", "visibility", "align", "extract", "accumulate", "solve", "pack", "save"}) {
    EXPECT_GE(figures.at("seconds").at(stage), 0) << stage;
    stages += figures.at("seconds").at(stage).get<double>();
  }
  EXPECT_GT(figures.at("seconds").at("total"), stages);

  const Outcome info = run("info o/place.maqs --json info.json");
  ASSERT_EQ(info.exit_code, 0) << info.err;
  EXPECT_NE(info.out.find(" blocks"), std::string::npos) << info.out;
  for (const char* key :
       {"points", "view_dependent_points", "blocks", "bytes", "coefficient_bits", "up", "bounds_min", "bounds_max"}) {
    EXPECT_EQ(json("info.json").at(key), figures.at(key)) << key;
  }
}

TEST_F(SceneCommandLine, SplatsAreExportedBuiltAndRendered) {
  ASSERT_EQ(run("build place --out o/place.maqs").exit_code, 0);
  const Outcome exported = run("export o/place.maqs --out o/place.ply");
  ASSERT_EQ(exported.exit_code, 0) << exported.err;
  EXPECT_NE(exported.out.find(" splats"), std::string::npos) << exported.out;
  const Outcome built = run("build place --out o/fitted.spz --fit-seconds 0.3 --json o/build.json");
  ASSERT_EQ(built.exit_code, 0) << built.err;
  ASSERT_EQ(run("export o/fitted.spz --out o/fitted.glb").exit_code, 0);
  for (const char* name : {"place.ply", "fitted.spz"}) {
    const Outcome info = run(std::string("info o/") + name);
    EXPECT_NE(info.out.find("splats"), std::string::npos) << info.out;
    const Outcome rendered =
        run(std::string("render o/") + name + " --capture place --views held-out --out o/" + name + ".images");
    EXPECT_EQ(rendered.exit_code, 0) << rendered.err;
  }
  const Outcome unknown = run("export o/place.maqs --out o/place.splat");
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_NE(unknown.err.find(".spz"), std::string::npos) << unknown.err;
  EXPECT_EQ(run("build place --out o/more.spz --ply o/points.ply").exit_code, 1);
}

TEST_F(SceneCommandLine, ASceneThatIsBuiltIntoADeviceIsNoFailure) {
  const Outcome result = run("build place --out /dev/null");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
}

TEST_F(SceneCommandLine, EveryOptionOfBuildingDoesWhatItSays) {
  const auto built = [&](const std::string& options) {
    const Outcome result = run("build place --out a.maqs --json a.json " + options);
    EXPECT_EQ(result.exit_code, 0) << options << result.err;
    return json("a.json");
  };
  const nlohmann::json usual = built("");
  EXPECT_EQ(usual.at("coefficient_bits"), 8);
  EXPECT_LE(built("--points 50").at("points"), 50);
  EXPECT_EQ(built("--views 2").at("views"), 2);
  EXPECT_EQ(built("--all-photos").at("views"), 5);
  EXPECT_EQ(built("--coefficients 16").at("coefficient_bits"), 16);
  EXPECT_EQ(built("--coefficients 32").at("coefficient_bits"), 32);
  EXPECT_EQ(built("--min-variation 100").at("view_dependent_points"), 0);
  EXPECT_LT(built("--visibility-scale 0.25").at("points"), usual.at("points"));
  // Who is too near hides nobody.
  EXPECT_NE(built("--near 3").at("points"), usual.at("points"));
  EXPECT_LT(built("--long-side 16").at("points"), usual.at("points"));
  EXPECT_EQ(built("--long-side 0 --threads 2").at("points"), usual.at("points"));
  environment_ = "MAQ_SCENE_BUNDLE=";
  EXPECT_EQ(built("--bundle '" MAQ_TEST_DATA "/tiny_scene/bundle'").at("points"), usual.at("points"));
}

TEST_F(SceneCommandLine, RendersPicturesWithTheFiguresThatTheBenchmarkReads) {
  build();
  const Outcome result =
      run("render place.maqs --capture place --views held-out --out o --json r.json --repeat 3 --threads 1 --near 0.1");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(files("o"), (std::set<std::string>{"3.png"}));
  const cv::Mat picture = cv::imread(file("o/3.png"), cv::IMREAD_UNCHANGED);
  EXPECT_EQ(picture.size(), cv::Size(72, 56));
  EXPECT_EQ(picture.channels(), 4);
  const nlohmann::json view = json("r.json").at("views").at(0);
  EXPECT_EQ(view.at("name"), "images/3.png");
  for (const char* stage : {"total", "project", "shade", "refine", "resample"}) EXPECT_GE(view.at("ms").at(stage), 0);
  EXPECT_GT(view.at("ms").at("total"), 0);
  EXPECT_GT(view.at("shaded_points"), 10);

  EXPECT_EQ(run("render place.maqs --capture place --views all --out all --no-alpha --size 40x30").exit_code, 0);
  EXPECT_EQ(files("all").size(), 5u);
  EXPECT_EQ(cv::imread(file("all/0.png"), cv::IMREAD_UNCHANGED).size(), cv::Size(40, 30));
  EXPECT_EQ(cv::imread(file("all/0.png"), cv::IMREAD_UNCHANGED).channels(), 3);
  EXPECT_EQ(run("render place.maqs --capture place --views images/1.png,images/4.png --out two").exit_code, 0);
  EXPECT_EQ(files("two"), (std::set<std::string>{"1.png", "4.png"}));
}

TEST_F(SceneCommandLine, RendersClipsThatPlay) {
  build();
  const Outcome orbit =
      run("render place.maqs --path orbit --out orbit.mp4 --seconds 0.5 --fps 10 --size 64x48 --json orbit.json");
  ASSERT_EQ(orbit.exit_code, 0) << orbit.err;
  EXPECT_NE(orbit.out.find("orbit.mp4: 5 frames"), std::string::npos) << orbit.out;
  EXPECT_EQ(frames_of("orbit.mp4", 64, 48), 5);
  EXPECT_EQ(json("orbit.json").at("frames"), 5);
  EXPECT_GT(json("orbit.json").at("ms").at("total"), 0);
  const Outcome through =
      run("render place.maqs --capture place --path through --out t.mp4 --seconds 0.4 --size 65x49");
  ASSERT_EQ(through.exit_code, 0) << through.err;
  EXPECT_EQ(frames_of("t.mp4", 64, 48), 10) << "of even sides";
}

TEST_F(SceneCommandLine, AClipHasTheNameThatWasGivenOrIsNotMade) {
  build();
  const std::string orbit = "render place.maqs --path orbit --seconds 0.2 --fps 10 ";
  const Outcome made = run(orbit + "--size 64x48 --out orbit.MP4");
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_EQ(frames_of("orbit.MP4", 64, 48), 2);
  for (const char* name : {"orbit.avi", "orbit"}) {
    expect_failure(orbit + "--size 64x48 --out " + name, std::string(name) + " does not end in .mp4");
  }
  expect_failure(orbit + "--size 1x1 --out tiny.mp4", "1 x 1 pixels, but a clip needs 2 x 2");
  expect_failure(orbit + "--size 64x48 --out o.mp4 --json none/a.json", "none/a.json cannot be made");
  EXPECT_EQ(files(), (std::set<std::string>{"place.maqs", "orbit.MP4"}));
}

TEST_F(SceneCommandLine, WhatIsMissingOrWrongIsOneSentence) {
  expect_failure("build nowhere --out a.maqs", "nowhere");
  expect_failure("build . --out a.maqs", "");
  expect_failure("build place --out a.maqs --bundle none", "none");
  expect_failure("build place --out out.txt/a.maqs", "cannot be written");
  expect_failure("build place --out place", "is a folder");
  expect_failure("render none.maqs --path orbit --out c.mp4", "none.maqs");
  expect_failure("info none.maqs", "none.maqs");
  expect_failure("info out.txt", "out.txt");
  EXPECT_EQ(files(), std::set<std::string>{});
  build();
  const std::string head = "render place.maqs --out o ";
  expect_failure(head, "--views with --capture for images, or --path for a clip");
  expect_failure(head + "--path orbit --views all", "--views with --capture for images, or --path for a clip");
  expect_failure(head + "--views all", "name its folder with --capture");
  expect_failure(head + "--path through", "name their folder with --capture");
  expect_failure(head + "--capture place --views nobody.png", "no photo nobody.png");
  expect_failure(head + "--capture place --views images/1.png,nobody.png", "no photo nobody.png");
  for (const char* size : {"640", "0x10", "640x480x3", "99999999999x10"}) {
    expect_failure(head + "--path orbit --size '" + size + "'", "write it as 640x480");
  }
  expect_failure("render place.maqs --out c.mp4 --path orbit --size 20000x10", "16384");
  expect_failure(head + "--capture place --views all --seconds 3", "--seconds and --fps are for clips");
  expect_failure(head + "--path orbit --repeat 3", "--repeat and --no-alpha are for images");
  std::filesystem::copy(file("place/"), file("all_used"), std::filesystem::copy_options::recursive);
  nlohmann::json transforms = json("all_used/transforms.json");
  transforms.erase("test_filenames");
  write_text(file("all_used/transforms.json"), transforms.dump());
  expect_failure(head + "--capture all_used --views held-out", "has no held-out photos; use --views all");
  EXPECT_EQ(files(), (std::set<std::string>{"place.maqs", "all_used"}));
}

TEST_F(SceneCommandLine, PhotosOfOneNameAreToldApartBeforeOneIsLost) {
  build();
  std::filesystem::copy(file("place/"), file("twice"), std::filesystem::copy_options::recursive);
  std::filesystem::create_directory(file("twice/more"));
  std::filesystem::copy(file("place/images/1.png"), file("twice/more/0.png"));
  nlohmann::json transforms = json("twice/transforms.json");
  transforms["frames"][1]["file_path"] = "more/0.png";
  write_text(file("twice/transforms.json"), transforms.dump());
  expect_failure("render place.maqs --capture twice --views all --out o",
                 "Two photos of the capture would both become 0.png");
  EXPECT_EQ(run("render place.maqs --capture twice --views more/0.png --out o").exit_code, 0);
}

TEST_F(SceneCommandLine, WrongUsageIsExitCodeTwoAndHelpTeaches) {
  for (const char* arguments :
       {"", "build", "build place", "build place --out a --coefficients 12", "build place --out a --points 0",
        "build place --out a --visibility-scale 2", "build place --out a --threads 0",
        "render a.maqs --path round --out o", "render a.maqs --path orbit --fps 0 --out o", "info"}) {
    EXPECT_EQ(run(arguments).exit_code, 2) << arguments;
  }
  EXPECT_EQ(files(), std::set<std::string>{});
  const Outcome help = run("--help");
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_NE(help.out.find("maquette scene build my-room --out my-room.maqs"), std::string::npos) << help.out;
}

TEST_F(SceneCommandLine, CtrlCLeavesTheOldFiles) {
  build();
  const std::string before = read_text(file("place.maqs"));
  write_text(file("clip.mp4"), "an older clip");
  const auto interrupted = [&](const std::string& arguments) {
    // A second is far less than this takes. Without --foreground the signal comes twice.
    const std::string command = "cd '" + folder_.path().string() + "' && " + environment_ +
                                " timeout --foreground --preserve-status -s INT 1 " MAQ_TEST_EMULATOR " '" MAQ_TEST_CLI
                                "' scene " +
                                arguments + " >out.txt 2>err.txt";
    const int status = std::system(command.c_str());
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 130) << arguments << status;
    EXPECT_NE(read_text(file("err.txt")).find("Interrupted;"), std::string::npos) << read_text(file("err.txt"));
  };
  interrupted("render place.maqs --path orbit --seconds 600 --fps 240 --size 320x240 --out clip.mp4");
  EXPECT_EQ(read_text(file("clip.mp4")), "an older clip");
  // A capture of the same few photos many times over.
  std::filesystem::copy(file("place/"), file("long"), std::filesystem::copy_options::recursive);
  nlohmann::json transforms = json("long/transforms.json");
  const nlohmann::json frame = transforms["frames"][0];
  transforms["frames"] = nlohmann::json::array();
  for (int i = 0; i < 4000; ++i) {
    const std::string name = "images/copy" + std::to_string(i) + ".png";
    std::filesystem::create_hard_link(file("long/images/0.png"), file("long/" + name));
    transforms["frames"].push_back(frame);
    transforms["frames"].back()["file_path"] = name;
  }
  write_text(file("long/transforms.json"), transforms.dump());
  interrupted("build long --out place.maqs");
  EXPECT_EQ(read_text(file("place.maqs")), before);
  EXPECT_EQ(files(), (std::set<std::string>{"place.maqs", "clip.mp4", "long"}));
}

}  // namespace
