# SPDX-License-Identifier: MIT
# Has the editor import SINEW_skinning. A game that loads files itself registers the reader alike.
@tool
extends EditorPlugin

var _reader := preload("reader.gd").new()


func _enter_tree() -> void:
	GLTFDocument.register_gltf_document_extension(_reader)


func _exit_tree() -> void:
	GLTFDocument.unregister_gltf_document_extension(_reader)
