// Counts the people of every frame of a source, with the C++ header: count_people <bundle> <source>.
#include <iostream>
#include <maquette/maquette.hpp>

int main(int argc, char** argv) try {
  if (argc != 3) throw std::runtime_error("usage: count_people <bundle> <source>");
  const maquette::Context context;
  maquette::DensePose densepose(context, argv[1]);
  maquette::Source source(context, argv[2]);
  while (const auto frame = source.next()) {
    std::cout << densepose.run(*frame).people().size() << " people\n";
  }
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
