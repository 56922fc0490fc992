// Counts the people of every frame of a source, with the C++ header: count_people <source>.
#include <iostream>
#include <maquette/maquette.hpp>

int main(int argc, char** argv) try {
  if (argc != 2) throw std::runtime_error("usage: count_people <source>");
  const maquette::Context context;
  maquette::DensePose densepose(context);
  maquette::Source source(context, argv[1]);
  while (const auto frame = source.next()) {
    std::cout << densepose.run(*frame).person_count() << " people\n";
  }
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
