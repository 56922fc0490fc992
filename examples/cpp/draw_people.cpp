// Writes the people of a photo over it: draw_people <photo> <image.png> [detectron2].
// With detectron2: in the colours that ControlNet models expect, on black.
#include <iostream>
#include <maquette/maquette.hpp>
#include <string>
#include <vector>

int main(int argc, char** argv) try {
  if (argc < 3) throw std::runtime_error("usage: draw_people <photo> <image.png> [detectron2]");
  const bool is_hint = argc > 3 && std::string(argv[3]) == "detectron2";
  const maquette::Context context;
  const auto photo = maquette::Source(context, argv[1]).next();
  if (!photo) throw std::runtime_error(std::string(argv[1]) + " has no image.");
  const auto people = maquette::DensePose(context).run(*photo);

  maq_densepose_drawing drawing;
  maquette::check(maq_densepose_drawing_init(&drawing, sizeof drawing));
  if (is_hint) {
    drawing.opacity = 255;
    drawing.colours = MAQ_DENSEPOSE_COLOURS_DETECTRON2;
  }
  std::vector<uint8_t> rgba(size_t(people.width_px()) * size_t(people.height_px()) * 4);
  people.draw(is_hint ? nullptr : &*photo, drawing, rgba.data(), 0, rgba.size());

  maq_frame_desc desc{};
  desc.struct_size = sizeof desc;
  desc.format = MAQ_PIXEL_RGBA8;
  desc.width_px = people.width_px();
  desc.height_px = people.height_px();
  desc.planes[0] = rgba.data();
  desc.clock = MAQ_CLOCK_MEDIA;
  maquette::Frame(context, desc).save(argv[2]);
  std::cout << people.person_count() << " people\n";
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
