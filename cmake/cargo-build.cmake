# Builds the library with cargo, and lays it out in LIBRARY_DIR as it will be installed.
set(arguments build --release --locked --lib --package iine --target-dir ${TARGET_DIR})
set(output ${TARGET_DIR}/release)
if(RUST_TARGET)
  list(APPEND arguments --target ${RUST_TARGET})
  set(output ${TARGET_DIR}/${RUST_TARGET}/release)
  string(TOUPPER "${RUST_TARGET}" name)
  string(REPLACE "-" "_" name "${name}")
  set(ENV{CARGO_TARGET_${name}_LINKER} ${LINKER})
else()
  # It would change where cargo puts the library.
  unset(ENV{CARGO_BUILD_TARGET})
endif()

execute_process(COMMAND ${CARGO} ${arguments} RESULT_VARIABLE result)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "cargo build failed")
endif()

file(MAKE_DIRECTORY ${LIBRARY_DIR})
configure_file(${output}/libiine.so ${LIBRARY_DIR}/libiine.so.${VERSION} COPYONLY)
configure_file(${output}/libiine.a ${LIBRARY_DIR}/libiine.a COPYONLY)
file(CREATE_LINK libiine.so.${VERSION} ${LIBRARY_DIR}/libiine.so.${ABI} SYMBOLIC)
file(CREATE_LINK libiine.so.${ABI} ${LIBRARY_DIR}/libiine.so SYMBOLIC)
