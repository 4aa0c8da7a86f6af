# The targets, for the build tree and for the installed package alike.
#
#   iine::iine        the C API: iine::shared, or iine::static if IINE_SHARED, else BUILD_SHARED_LIBS, is off
#   iine::shared      libiine.so
#   iine::static      libiine.a and what it needs
#   iine::pcl         the C++ class for PCL (header-only) on iine::iine, and PCL itself once it has been found
#   iine::pcl_dropin  iine::pcl, and #include <pcl/features/integral_image_normal.h> is ours
#
# In: iine_LIBRARY_DIR, iine_INCLUDE_DIR, iine_VERSION, iine_ABI (as in the SONAME), iine_SCOPE (GLOBAL or empty).

# What rustc says a static library of this crate needs (--print native-static-libs; a test compares), but for gcc_s:
# compilers add it themselves, or gcc_eh with -static.
set(iine_STATIC_LIBRARIES util rt pthread m dl c)

# Some of the targets may be there: those that a directory beside this one has made global.
if(NOT TARGET iine::shared)
  add_library(iine::shared SHARED IMPORTED ${iine_SCOPE})
  set_target_properties(iine::shared PROPERTIES
    IMPORTED_LOCATION "${iine_LIBRARY_DIR}/libiine.so.${iine_VERSION}"
    IMPORTED_SONAME libiine.so.${iine_ABI}
    INTERFACE_INCLUDE_DIRECTORIES "${iine_INCLUDE_DIR}")
endif()

# A shared library with iine::static in it would else export all of iine and of Rust's library.
if(NOT TARGET iine::static)
  add_library(iine::static STATIC IMPORTED ${iine_SCOPE})
  set_target_properties(iine::static PROPERTIES
    IMPORTED_LOCATION "${iine_LIBRARY_DIR}/libiine.a"
    INTERFACE_INCLUDE_DIRECTORIES "${iine_INCLUDE_DIR}"
    INTERFACE_LINK_OPTIONS LINKER:--exclude-libs,libiine.a
    INTERFACE_LINK_LIBRARIES "${iine_STATIC_LIBRARIES}")
endif()

# No alias: try_compile, and so check_symbol_exists and its like, know none.
if(NOT TARGET iine::iine)
  set(iine_kind shared)
  if(DEFINED IINE_SHARED)
    if(NOT IINE_SHARED)
      set(iine_kind static)
    endif()
  elseif(DEFINED BUILD_SHARED_LIBS AND NOT BUILD_SHARED_LIBS)
    set(iine_kind static)
  endif()
  add_library(iine::iine INTERFACE IMPORTED ${iine_SCOPE})
  set_target_properties(iine::iine PROPERTIES INTERFACE_LINK_LIBRARIES iine::${iine_kind})
  unset(iine_kind)
endif()

# PCL is looked up where a target is used, so it may be found before or after iine (but before add_subdirectory, which
# sees what was found until then); without it, CMake names the missing target.
set(iine_pcl_found $<TARGET_EXISTS:pcl_features>)
if(NOT TARGET iine::pcl)
  add_library(iine::pcl INTERFACE IMPORTED ${iine_SCOPE})
  set_target_properties(iine::pcl PROPERTIES
    INTERFACE_COMPILE_FEATURES cxx_std_14
    INTERFACE_LINK_LIBRARIES
      "iine::iine;$<IF:${iine_pcl_found},pcl_features,iine::needs_find_package_PCL_COMPONENTS_features>")
endif()

# Our <pcl/features/integral_image_normal.h> must be found before PCL's, also where a project names PCL's
# directory itself by include_directories(), which CMake puts first. Compilers search every -I directory before
# any -isystem one, and ignore the -I of a directory that is named by -isystem too. So ours is -I, and PCL's own
# (include/pcl-1.13) is -isystem.
if(NOT TARGET iine::pcl_dropin)
  set(iine_pcl_dirs $<TARGET_PROPERTY:pcl_features,INTERFACE_INCLUDE_DIRECTORIES>)
  set(iine_pcl_dirs $<REMOVE_DUPLICATES:$<FILTER:${iine_pcl_dirs},INCLUDE,/pcl-[0-9.]+/?$>>)
  set(iine_pcl_dirs "-I${iine_INCLUDE_DIR}/iine/pcl/dropin;$<${iine_pcl_found}:${iine_pcl_dirs}>")
  add_library(iine::pcl_dropin INTERFACE IMPORTED ${iine_SCOPE})
  set_target_properties(iine::pcl_dropin PROPERTIES
    INTERFACE_LINK_LIBRARIES iine::pcl
    INTERFACE_COMPILE_OPTIONS
      "$<$<COMPILE_LANGUAGE:CXX>:SHELL:\"$<JOIN:${iine_pcl_dirs},\" -isystem \">\">")
  unset(iine_pcl_dirs)
endif()
unset(iine_pcl_found)
