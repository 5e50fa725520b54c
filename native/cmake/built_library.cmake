# The library as SINEW_BUILT has it: what all Pythons share takes minutes to compile, a module seconds.
add_library(sinew SHARED IMPORTED GLOBAL)
add_library(sinew::sinew ALIAS sinew)
set_target_properties(sinew PROPERTIES IMPORTED_LOCATION "${SINEW_BUILT}/native/sinew/libsinew.so")
target_include_directories(sinew INTERFACE "${PROJECT_SOURCE_DIR}/native" "${SINEW_BUILT}/native/sinew/include")
target_compile_features(sinew INTERFACE cxx_std_20)
target_compile_definitions(sinew INTERFACE SINEW_WITH_DDM=$<BOOL:${SINEW_WITH_DDM}>)
target_link_libraries(sinew INTERFACE glm::glm)
install(FILES "${SINEW_BUILT}/native/sinew/libsinew.so" DESTINATION sinew)
