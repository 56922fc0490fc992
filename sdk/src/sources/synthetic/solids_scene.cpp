#include "sources/synthetic/solids_scene.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/error.h"
#include "sources/synthetic/dice.h"

namespace maq {
namespace {

constexpr double kPeriodS = 24;

struct Direction {
  double cosine, sine;
};

// By Taylor's series and not by libm, whose last bits differ between systems.
Direction direction_of(double turns) {
  constexpr double kTwoPi = 6.283185307179586476925286766559;
  const double quarters = std::floor(4 * turns + 0.5);
  const double x = kTwoPi * (turns - quarters / 4), xx = x * x;  // of at most an eighth of a turn
  double cosine = 1, sine = 1;
  for (int n = 16; n >= 2; n -= 2) {
    cosine = 1 - cosine * xx / (n * (n - 1));
    sine = 1 - sine * xx / (n * (n + 1));
  }
  sine *= x;
  switch (int(quarters - 4 * std::floor(quarters / 4))) {
    case 1: return {-sine, cosine};
    case 2: return {-cosine, -sine};
    case 3: return {sine, -cosine};
    default: return {cosine, sine};
  }
}

// --- what is where, in millimetres: y is that of the bottom, 0 or, higher up, less -----------------------------------

struct Furniture {
  int16_t x, y, z, width, height, depth;
};

enum Kind : int16_t { kCarton, kRounded, kBin };

// A thing of random size: a carton, one of whose vertical edges is rounded, or an upright cylinder as wide as `width`.
struct Thing {
  Kind kind;
  int16_t x, y, z;
  int16_t min_width, max_width, min_height, max_height, min_depth, max_depth;
  int16_t max_turn;  // to each side, in thousandths of a turn
};

constexpr int16_t kEdgeRadius = 30;

constexpr Furniture kFloor = {0, 1000, 0, 32000, 1000, 32000};
constexpr Furniture kWall[] = {{0, 16000, 500, 32000, 32000, 1000}};
// Boards end at the panels on both sides, and a little behind their front.
constexpr Furniture kShelf[] = {kFloor,
                                {0, 0, 960, 20000, 10000, 1000},
                                {0, 0, 370, 1000, 1700, 20},
                                {-490, 0, 180, 20, 1700, 360},
                                {490, 0, 180, 20, 1700, 360},
                                {0, -80, 190, 960, 20, 340},
                                {0, -480, 190, 960, 20, 340},
                                {0, -880, 190, 960, 20, 340},
                                {0, -1280, 190, 960, 20, 340}};
// A wall behind and one at the left, and a table.
constexpr Furniture kRoom[] = {kFloor,
                               {0, 0, 2000, 20000, 4000, 1000},
                               {-2000, 0, -8500, 1000, 4000, 20000},
                               {100, -710, 900, 1300, 30, 700},
                               {-490, 0, 610, 50, 710, 50},
                               {690, 0, 610, 50, 710, 50},
                               {-490, 0, 1190, 50, 710, 50},
                               {690, 0, 1190, 50, 710, 50}};

constexpr Thing kBoxThings[] = {{kCarton, 0, 0, 0, 200, 600, 150, 500, 150, 450, 0}};
constexpr Thing kShelfThings[] = {{kCarton, -320, -100, 185, 144, 224, 80, 300, 120, 200, 30},
                                  {kCarton, 0, -100, 185, 144, 224, 80, 300, 120, 200, 30},
                                  {kCarton, 320, -100, 185, 144, 224, 80, 300, 120, 200, 30},
                                  {kRounded, -240, -500, 185, 216, 336, 80, 300, 120, 200, 30},
                                  {kCarton, 240, -500, 185, 216, 336, 80, 300, 120, 200, 30},
                                  {kCarton, -240, -900, 185, 216, 336, 80, 300, 120, 200, 30},
                                  {kCarton, 240, -900, 185, 216, 336, 80, 300, 120, 200, 30},
                                  {kCarton, 0, -1300, 185, 216, 500, 80, 300, 120, 200, 10}};
constexpr Thing kRoomThings[] = {{kCarton, -200, -740, 900, 200, 350, 120, 350, 200, 350, 100},
                                 {kCarton, 900, 0, -200, 250, 500, 150, 500, 250, 500, 120},
                                 {kCarton, -900, 0, 0, 250, 500, 150, 500, 250, 500, 120},
                                 {kRounded, 420, -740, 850, 150, 300, 90, 300, 150, 300, 50},
                                 {kBin, 50, 0, -400, 200, 320, 250, 450, 0, 0, 0}};

struct Plan {
  const char* name;
  const Furniture* furniture;
  size_t furniture_count;
  const Thing* things;
  size_t thing_count;
  int16_t target_y, target_z;
  int16_t min_distance, max_distance;
  int16_t min_pitch, max_pitch;  // thousandths of a turn
  int16_t swing;                 // thousandths of a turn; 0: all around
};

constexpr Plan kPlans[] = {
    {"wall", kWall, std::size(kWall), nullptr, 0, 0, 0, 800, 2500, -50, 50, 110},
    {"box", &kFloor, 1, kBoxThings, std::size(kBoxThings), -160, 0, 1200, 1600, 85, 120, 0},
    {"shelf", kShelf, std::size(kShelf), kShelfThings, std::size(kShelfThings), -850, 180, 1900, 2300, 10, 40, 60},
    {"room", kRoom, std::size(kRoom), kRoomThings, std::size(kRoomThings), -500, 600, 2800, 3200, 50, 70, 40}};

// --- built of these
// ---------------------------------------------------------------------------------------------------

double metres(double millimetres) { return millimetres * 0.001; }

Solid standing_box(double x, double y, double z, double width, double height, double depth) {
  Solid box;
  box.half = {metres(0.5 * width), metres(0.5 * height), metres(0.5 * depth)};
  box.centre = {metres(x), metres(y) - box.half[1], metres(z)};
  return box;
}

// The vertical edge at the right of the front is rounded: two boxes that leave out a square there, and a cylinder in
// it.
void add_rounded_box(SolidsScene& scene, const Solid& box, double radius) {
  const auto add_part = [&](double x, double z, const Vector3& half, double part_radius) {  // in the box's directions
    Solid part = box;
    part.centre[0] += box.cosine * x - box.sine * z;
    part.centre[2] += box.sine * x + box.cosine * z;
    part.half = half;
    part.radius = part_radius;
    scene.solids.push_back(part);
  };
  const double x = box.half[0], y = box.half[1], z = box.half[2];
  add_part(-0.5 * radius, 0, {x - 0.5 * radius, y, z}, 0);
  add_part(0, 0.5 * radius, {x, y, z - 0.5 * radius}, 0);
  add_part(x - radius, radius - z, {radius, y, radius}, radius);
}

void add_thing(SolidsScene& scene, const Thing& thing, Dice& dice) {
  const double width = dice.between(thing.min_width, thing.max_width);
  const double height = dice.between(thing.min_height, thing.max_height);
  const double depth = thing.kind == kBin ? width : dice.between(thing.min_depth, thing.max_depth);
  Solid solid = standing_box(thing.x, thing.y, thing.z, width, height, depth);
  const Direction direction = direction_of(metres(dice.between(-thing.max_turn, thing.max_turn)));
  solid.cosine = direction.cosine;
  solid.sine = direction.sine;
  solid.radius = thing.kind == kBin ? solid.half[0] : 0;
  if (thing.kind == kRounded) return add_rounded_box(scene, solid, metres(kEdgeRadius));
  solid.is_carton = thing.kind == kCarton;
  scene.solids.push_back(solid);
}

}  // namespace

SolidsScene make_solids_scene(const std::string& name, uint64_t seed) {
  const auto plan =
      std::find_if(std::begin(kPlans), std::end(kPlans), [&](const Plan& one) { return name == one.name; });
  if (plan == std::end(kPlans)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "scene=", name, " is not known; there are wall, box, shelf and room.");
  }
  Dice dice(seed);
  SolidsScene scene;
  for (size_t i = 0; i < plan->furniture_count; ++i) {
    const Furniture& one = plan->furniture[i];
    scene.solids.push_back(standing_box(one.x, one.y, one.z, one.width, one.height, one.depth));
  }
  for (size_t i = 0; i < plan->thing_count; ++i) add_thing(scene, plan->things[i], dice);
  scene.target = {0, metres(plan->target_y), metres(plan->target_z)};
  scene.distance = metres(dice.between(plan->min_distance, plan->max_distance));
  scene.pitch_turns = metres(dice.between(plan->min_pitch, plan->max_pitch));
  scene.swing_turns = metres(plan->swing);
  scene.first_turns = plan->swing == 0 ? dice.between(0, 1) : 0;
  return scene;
}

SolidsView solids_view(const SolidsScene& scene, double time_s) {
  const double turns = time_s / kPeriodS;
  const bool goes_around = scene.swing_turns == 0;
  const Direction yaw =
      direction_of(scene.first_turns + (goes_around ? turns : scene.swing_turns * direction_of(turns).sine));
  const Direction pitch = direction_of(scene.pitch_turns);
  SolidsView view;
  view.axes[0] = {yaw.cosine, 0, -yaw.sine};
  view.axes[1] = {-pitch.sine * yaw.sine, pitch.cosine, -pitch.sine * yaw.cosine};
  view.axes[2] = {pitch.cosine * yaw.sine, pitch.sine, pitch.cosine * yaw.cosine};
  view.centre = scene.target - scene.distance * view.axes[2];
  return view;
}

}  // namespace maq
