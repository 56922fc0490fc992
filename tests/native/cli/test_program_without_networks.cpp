// The `maquette` program where no networks are installed: which are missing, and how to get them.
#include <gtest/gtest.h>

#include <string>
#include <tuple>

#include "support/program_run.h"

namespace {

// A copy of the program that has no networks beside it.
class ProgramWithoutNetworks : public ::testing::Test {
 protected:
  ProgramWithoutNetworks() {
    namespace fs = std::filesystem;
    const fs::path stage = fs::path(MAQ_TEST_CLI).parent_path().parent_path();
    fs::create_directories(folder_.file("alone/bin"));
    fs::copy_file(MAQ_TEST_CLI, folder_.file("alone/bin/maquette"));
    fs::create_directory_symlink(stage / "lib", folder_.file("alone/lib"));
  }

  Outcome run_alone(const std::string& arguments) {
    return run_shell(folder_, "", MAQ_TEST_EMULATOR " ./alone/bin/maquette " + arguments);
  }

  std::string place(const std::string& bundle) const { return folder_.file("alone/share/maquette/models/" + bundle); }

  TempFolder folder_;
};

TEST_F(ProgramWithoutNetworks, EachCommandSaysWhichAreMissingWhereTheyWereLookedForAndHowToGetThem) {
  for (const auto& [arguments, system, bundle, variable] :
       {std::tuple("densepose " MAQ_TEST_MEDIA "/photo.jpg --out o", "densepose", "densepose-b-int8", "MAQ_BUNDLE"),
        {"edges 'image:" MAQ_TEST_MEDIA "/box_depth.png?fov=60&depth_unit=0.001' --boxes", "edges", "edges-int8",
         "MAQ_EDGES_BUNDLE"},
        {"head " MAQ_TEST_MEDIA "/photo.jpg --box 0,0,99,99 --out a.glb", "heads", "heads-int8", "MAQ_HEADS_BUNDLE"},
        {"scene build '" MAQ_TEST_DATA "/tiny_scene/capture' --out a.maqs", "scenes", "scenes-int8",
         "MAQ_SCENE_BUNDLE"},
        {"predict 'stub:pattern?frames=9' --method sampled --compare", "prediction", "prediction-int8",
         "MAQ_PREDICTION_BUNDLE"}}) {
    const Outcome result = run_alone(arguments);
    EXPECT_EQ(result.exit_code, 1) << arguments;
    for (const std::string& text :
         {"The networks of " + std::string(system) + " are not installed", place(bundle) + "/manifest.json",
          "pip install 'maquette[" + std::string(system) + "]'", std::string(variable) + " to the folder",
          "sdk/models/" + std::string(bundle)}) {
      EXPECT_NE(result.err.find(text), std::string::npos) << arguments << ": " << text << "\n" << result.err;
    }
  }
}

TEST_F(ProgramWithoutNetworks, TheDoctorAndInfoListThemAsNotInstalled) {
  const Outcome doctor = run_alone("doctor");
  const Outcome info = run_alone("info");
  EXPECT_EQ(info.exit_code, 0) << info.err;
  for (const std::string system : {"densepose", "scenes", "edges", "heads", "prediction"}) {
    EXPECT_NE(doctor.out.find("note  The networks of " + system + " are not installed"), std::string::npos)
        << doctor.out;
    EXPECT_NE(doctor.out.find("maquette[" + system + "]"), std::string::npos) << doctor.out;
    const std::string row = system + std::string(10 - system.size(), ' ') + "  not installed";
    EXPECT_NE(info.out.find(row), std::string::npos) << info.out;
  }
}

}  // namespace
