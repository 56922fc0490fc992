# Writes a C++ file that holds the bytes of INPUT, for `cmake -DINPUT=… -DOUTPUT=… -DHEADER=… -DFUNCTION=… -P`.
# FUNCTION returns a maq::EmbeddedFile, which HEADER declares. Without INPUT the file is embedded as empty.
if(EXISTS "${INPUT}")
  file(READ "${INPUT}" bytes HEX)
  string(REGEX REPLACE "(..)" "0x\\1," bytes "${bytes}")
  string(REGEX REPLACE "(0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,)" "\\1\n"
    bytes "${bytes}")
  set(array "  static const uint8_t kBytes[] = {\n${bytes}};\n")
  set(value "{kBytes, sizeof kBytes}")
else()
  set(array "")
  set(value "{}")
endif()
file(WRITE "${OUTPUT}" "#include \"${HEADER}\"

namespace maq {

EmbeddedFile ${FUNCTION}() {
${array}  return ${value};
}

}  // namespace maq
")
