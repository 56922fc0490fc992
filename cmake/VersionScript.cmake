# Writes a linker version script that exports the symbols listed in LIST (one a line) and hides the rest,
# for `cmake -DLIST=… -DOUTPUT=… -P`.
file(STRINGS "${LIST}" symbols REGEX "^[a-z]")
list(JOIN symbols ";\n    " symbols)
file(WRITE "${OUTPUT}" "{\n  global:\n    ${symbols};\n  local:\n    *;\n};\n")
