# SPDX-License-Identifier: Apache-2.0
# cmake -D HEADERS=... -P oneof_case_last.cmake: in generated headers, the case of a oneof is set after its message
# was allocated. protoc 3.21 sets the case first: where the allocation throws, the destructor then frees a pointer
# that nobody has set. (GCC clears the union beforehand, clang does not.) Tested by OneofWithoutMemory.
foreach(header IN LISTS HEADERS)
  file(READ ${header} text)
  string(REGEX REPLACE "( +set_has_[A-Za-z0-9_]+\\(\\)[;]\n)( +[A-Za-z0-9_.]+ = CreateMaybeMessage<[^;]*[;]\n)"
                       "\\2\\1" mended "${text}")
  if(NOT mended STREQUAL text)
    file(WRITE ${header} "${mended}")
  endif()
endforeach()
