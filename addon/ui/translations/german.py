# SPDX-License-Identifier: GPL-3.0-or-later
"""The German texts, in the words of Blender's own translation: Masche, Skelett, Punktgruppe, Einzelbild.
Where Blender has a text itself, its own is shown."""

# A text in English: the same in German, with the same names in braces.
TEXTS = {
    # Methods, their groups and parameters
    "Linear Blend": "Linear",
    "Fast, smooth and what every engine plays; twisted and strongly bent joints lose volume": (
        "Schnell, glatt, und jede Engine spielt es ab; verdrehte und stark gebeugte Gelenke verlieren Volumen"
    ),
    "Dual Quaternion": "Duale Quaternionen",
    "Keeps the volume of twisted joints anywhere on the body; strong bends bulge outwards": (
        "Erhält das Volumen verdrehter Gelenke überall am Körper; starke Beugungen wölben sich nach außen"
    ),
    "Centres of Rotation": "Drehzentren",
    "Keeps the volume of twisted joints and bulges half as much as dual quaternions where they bend; "
    "large meshes are bound a second longer": (
        "Erhält das Volumen verdrehter Gelenke und wölbt sich beim Beugen halb so stark wie duale "
        "Quaternionen; große Maschen werden eine Sekunde länger gebunden"
    ),
    "Direct Delta Mush": "Direct Delta Mush",
    "Makes smooth joints of crude weights, even of one bone a vertex; joints lose some volume, and "
    "large meshes are bound some seconds longer": (
        "Macht aus groben Gewichtungen weiche Gelenke, auch bei einem Knochen je Punkt; Gelenke "
        "verlieren etwas Volumen, und große Maschen werden einige Sekunden länger gebunden"
    ),
    "Spherical Deform": "Sphärische Deformation",
    "The shape that MikuMikuDance gives its models; vertices without such data are blended linearly": (
        "Die Form, die MikuMikuDance seinen Modellen gibt; Punkte ohne solche Daten werden linear gemischt"
    ),
    "Quaternion-Vector": "Quaternion-Vektor",
    "Keeps twisted limbs round near the armature's origin; joints far from it drift off their bones": (
        "Hält verdrehte Glieder nahe am Ursprung des Skeletts rund; weit davon entfernte Gelenke driften "
        "von ihren Knochen weg"
    ),
    "Spherical Blend": "Sphärische Mischung",
    "Dual quaternions' shape where two bones share a joint; tears where sets of three or more bones change": (
        "Die Form dualer Quaternionen, wo zwei Knochen ein Gelenk teilen; reißt, wo Gruppen von drei "
        "oder mehr Knochen wechseln"
    ),
    "Log-Matrix": "Log-Matrix",
    "Spreads a twist evenly along limbs near their rest pose; flips where a bone passes 180 degrees "
    "from rest": (
        "Verteilt eine Verdrehung nahe der Ruhepose gleichmäßig über das Glied; klappt um, wo ein "
        "Knochen 180 Grad gegen die Ruhepose überschreitet"
    ),
    "Iterative Dual Quaternion": "Duale Quaternionen, iterativ",
    "Dual quaternions with twists spread evenly along the limb; bulges as they do, at several times "
    "the cost": (
        "Duale Quaternionen, deren Verdrehung sich gleichmäßig über das Glied verteilt; wölbt sich "
        "ebenso, bei mehrfachem Aufwand"
    ),
    "Blender's": "Wie in Blender",
    "Volume Keeping": "Volumen erhaltend",
    "For Crude Weights": "Für grobe Gewichtungen",
    "For MMD": "Für MMD",
    "From the Report": "Aus dem Bericht",
    "Armature modifier": "Skelett-Modifikator",
    "What Blender's modifier does, as its options say": (
        "Was Blenders Modifikator tut, wie seine Optionen es sagen"
    ),
    "Variant": "Variante",
    "0: the rotation that fits the neighbourhood best; 2: the blended quaternion, faster; 4: fastest, "
    "of smoothed weights alone": (
        "0: die Rotation, die am besten zur Umgebung passt; 2: das gemischte Quaternion, schneller; 4: "
        "am schnellsten, nur aus geglätteten Gewichtungen"
    ),
    "How far the smoothing reaches, in units of the object, however dense the mesh is; another value "
    "has the mesh bound anew": (
        "Wie weit die Glättung reicht, in Einheiten des Objekts, wie dicht die Masche auch ist; bei "
        "einem anderen Wert wird die Masche neu gebunden"
    ),
    "Interpolation": "Interpolation",
    "How two rotations are blended: by the normalised sum of quaternions, as mmd_tools does, or at "
    "even speed, as MikuMikuDance's other players do": (
        "Wie zwei Rotationen gemischt werden: durch die normierte Summe der Quaternionen wie in "
        "mmd_tools oder mit gleichmäßigem Tempo wie in anderen Programmen für MikuMikuDance"
    ),
    "Nlerp": "Nlerp",
    "Slerp": "Slerp",
    "centres of rotation": "Drehzentren",
    "smoothed weights": "geglättete Gewichtungen",
    # Stages
    "Mix": "Mischen",
    "A vertex group says where another method takes over, as at a twisted wrist or a bent elbow": (
        "Eine Punktgruppe sagt, wo eine andere Methode übernimmt, etwa am verdrehten Handgelenk oder "
        "gebeugten Ellbogen"
    ),
    "Second Method": "Zweite Methode",
    "The method that the weights mix in": "Die Methode, die nach den Gewichtungen beigemischt wird",
    "Off": "Aus",
    "Without this stage": "Ohne diese Stufe",
    "Vertex Group": "Punktgruppe",
    "The share of the second method: 0 none of it, 1 all of it": (
        "Der Anteil der zweiten Methode: 0 nichts davon, 1 nur sie"
    ),
    "Limit Bulge": "Wölbung begrenzen",
    "Elbows and knees that bulge where they bend stay as thick as they are at rest": (
        "Ellbogen und Knie, die sich beim Beugen wölben, bleiben so dick wie in Ruhe"
    ),
    "Keep vertices from bulging away from their bones": (
        "Verhindert, dass sich Punkte von ihren Knochen weg wölben"
    ),
    "Strength": "Stärke",
    "How much of the bulge is taken away: 0 nothing, 1 all of it": (
        "Wie viel von der Wölbung weggenommen wird: 0 nichts, 1 alles"
    ),
    "Form": "Form",
    "Measure the distance to all bones of a vertex, or to the heaviest alone, which tears the surface "
    "where that changes": (
        "Misst den Abstand zu allen Knochen eines Punktes oder nur zum stärksten; das reißt die "
        "Oberfläche auf, wo dieser wechselt"
    ),
    "Continuous": "Stetig",
    "Kim Han": "Kim Han",
    "How much each vertex is limited: 0 not at all, 1 fully": (
        "Wie stark jeder Punkt begrenzt wird: 0 gar nicht, 1 ganz"
    ),
    "Delta Mush": "Delta Mush",
    "Smooth what crude weights crease or bulge and keep the details, as Corrective Smooth does": (
        "Glättet, was grobe Gewichtungen knicken oder wölben, und erhält die Details wie Corrective Smooth"
    ),
    "Smooth what the bones make of the mesh, and keep its details": (
        "Glättet, was die Knochen aus der Masche machen, und erhält ihre Details"
    ),
    "Iterations": "Wiederholungen",
    "How often the mesh is smoothed; not used with a radius": (
        "Wie oft die Masche geglättet wird; mit einem Radius ohne Wirkung"
    ),
    "Radius": "Radius",
    "How far the smoothing reaches, in units of the object, however dense the mesh is; 0 for so many "
    "iterations": (
        "Wie weit die Glättung reicht, in Einheiten des Objekts, wie dicht die Masche auch ist; 0: nach "
        "der Zahl der Wiederholungen"
    ),
    "Factor": "Faktor",
    "How far one iteration moves a vertex: 1 to the middle of its neighbours": (
        "Wie weit eine Wiederholung einen Punkt bewegt: 1 bis in die Mitte seiner Nachbarn"
    ),
    "Smooth Type": "Glättung",
    "Whether neighbours count alike, or by the length of their edges": (
        "Ob Nachbarn gleich viel zählen oder nach der Länge ihrer Kanten"
    ),
    "Simple": "Einfach",
    "Length Weighted": "Nach Länge",
    "Pin Boundary": "Rand festhalten",
    "The ends of edges with one face are not smoothed": (
        "Die Enden von Kanten mit nur einer Fläche werden nicht geglättet"
    ),
    "Scale": "Skalieren",
    "How much of the details comes back: 1 all, 0 none": (
        "Wie viel von den Details zurückkommt: 1 alles, 0 nichts"
    ),
    "How much each vertex is smoothed: 0 not at all, 1 fully": (
        "Wie stark jeder Punkt geglättet wird: 0 gar nicht, 1 ganz"
    ),
    "Invert": "Invertieren",
    "Smooth what the vertex group leaves out": "Glättet, was die Punktgruppe auslässt",
    # Settings
    "Method": "Methode",
    "Methods": "Methoden",
    "How the bones' motions are blended at each vertex": (
        "Wie die Bewegungen der Knochen an jedem Punkt gemischt werden"
    ),
    "How the bones' motions are blended, for all meshes of the character": (
        "Wie die Bewegungen der Knochen gemischt werden, für alle Maschen der Figur"
    ),
    "How this modifier blends, where several chained Armature modifiers deform the mesh. A method that is "
    "chosen for the mesh or the character goes to all of them again": (
        "Wie dieser Modifikator mischt, wenn mehrere Skelett-Modifikatoren nacheinander die Masche "
        "verformen. Eine Methode, die für die Masche oder die Figur gewählt wird, gilt wieder für alle"
    ),
    "Same Method": "Gleiche Methode",
    "The method that is chosen for the object": "Die Methode, die für das Objekt gewählt ist",
    "Armature": "Skelett",
    "The armature that deforms this mesh": "Das Skelett, das diese Masche verformt",
    "What becomes of bones' scale under methods that blend rigid motions": (
        "Was aus der Skalierung der Knochen wird, wenn die Methode starre Bewegungen mischt"
    ),
    "As Blender 4.0": "Wie Blender 4.0",
    "Each bone scales the vertex about itself before its motion is blended: Blender's rule since 4.0": (
        "Jeder Knochen skaliert den Punkt um sich selbst, bevor seine Bewegung gemischt wird: Blenders "
        "Regel seit 4.0"
    ),
    "As Blender 3": "Wie Blender 3",
    "The bones' scales are blended first, then their motions: Blender's rule up to 3.6": (
        "Erst werden die Skalierungen der Knochen gemischt, dann ihre Bewegungen: Blenders Regel bis 3.6"
    ),
    "Ignore Scale": "Ohne Skalierung",
    "Bones rotate and translate vertices and never scale them, under every method": (
        "Knochen drehen und verschieben Punkte und skalieren sie nie, bei jeder Methode"
    ),
    "On": "An",
    "off": "aus",
    "none": "keins",
    "and": "und",
    "On, hidden": "An, verborgen",
    "On, in part": "An, teilweise",
    "Deform with Sinew where the icon of its modifier is on. Where that of an Armature modifier is switched "
    "on, that deforms instead; where Sinew's is switched off, nothing does. Off: Blender's Armature modifier "
    "deforms, to compare the two": (
        "Mit Sinew verformen, wo das Symbol seines Modifikators an ist. Wo das eines Skelett-Modifikators "
        "angeschaltet wird, verformt dieser stattdessen; wo das von Sinew ausgeschaltet wird, nichts. Aus: "
        "Blenders Skelett-Modifikator verformt, um beide zu vergleichen"
    ),
    "Deform all meshes of the character with Sinew where the icon of its modifier is on. Where that of an "
    "Armature modifier is switched on, that deforms instead; where Sinew's is switched off, nothing does. "
    "Off: Blender's Armature modifier deforms, to compare the two": (
        "Alle Maschen der Figur mit Sinew verformen, wo das Symbol seines Modifikators an ist. Wo das eines "
        "Skelett-Modifikators angeschaltet wird, verformt dieser stattdessen; wo das von Sinew ausgeschaltet "
        "wird, nichts. Aus: Blenders Skelett-Modifikator verformt, um beide zu vergleichen"
    ),
    "Own Settings": "Eigenständig",
    "This mesh keeps settings of its own: what is set for the character does not change it": (
        "Diese Masche behält eigene Einstellungen: Was für die Figur eingestellt wird, ändert sie nicht"
    ),
    "Normals": "Normalen",
    "Who computes the normals that the mesh is drawn with (Blender 4.5 and later)": (
        "Wer die Normalen berechnet, mit denen die Masche gezeichnet wird (ab Blender 4.5)"
    ),
    "As Blender": "Wie Blender",
    "Sinew computes them with the points: the same, in less time": (
        "Sinew berechnet sie mit den Punkten: die gleichen, in weniger Zeit"
    ),
    "Skinned": "Mitbewegt",
    "Those of the rest pose move with the skin, as in game engines; imported ones are kept": (
        "Die der Ruhepose bewegen sich mit der Haut wie in Spiele-Engines; importierte bleiben erhalten"
    ),
    "Leave to Blender": "Blender überlassen",
    "Blender computes them whenever they are read": "Blender berechnet sie, sooft sie gelesen werden",
    "Leave to Blender Where Faster": "Blender überlassen, wo schneller",
    "Have the Armature modifier deform this mesh where it gives the same shape and, as the mesh is "
    "small, takes less time": (
        "Lässt den Skelett-Modifikator diese Masche verformen, wo er die gleiche Form ergibt und, weil "
        "sie klein ist, weniger Zeit braucht"
    ),
    "Add Sinew With": "Sinew hinzufügen mit",
    "The method that a click on Add Sinew starts with": (
        "Die Methode, mit der ein Klick auf Sinew hinzufügen beginnt"
    ),
    "Lengths": "Längen",
    "How measured lengths are shown in panels and heat maps": (
        "Wie gemessene Längen in Feldern und Wärmekarten gezeigt werden"
    ),
    "As the Scene": "Wie die Szene",
    "In the units of the scene": "In den Einheiten der Szene",
    "Millimetres": "Millimeter",
    "Always, where the scene has units": "Immer, wo die Szene Einheiten hat",
    "Plain Numbers": "Bloße Zahlen",
    "As Blender stores them, whatever the scene's units": (
        "Wie Blender sie speichert, gleich welche Einheiten die Szene hat"
    ),
    "Cache Folder": "Ordner für Zwischenspeicher",
    "Where numbers of vertices are kept that methods take long to compute; empty: the "
    "extension's own folder": (
        "Wo Zahlen der Punkte bleiben, an denen Methoden lange rechnen; leer: der eigene Ordner der "
        "Erweiterung"
    ),
    "Safe Mode": "Sicherer Modus",
    "Run nothing of Sinew within Blender's own evaluation: meshes are deformed after it, and Blender "
    "evaluates what stands behind once more. Slower; for scenes in which Blender crashes": (
        "Führt nichts von Sinew während Blenders eigener Auswertung aus: Maschen werden danach verformt, "
        "und Blender wertet noch einmal aus, was folgt. Langsamer; für Szenen, in denen Blender abstürzt"
    ),
    "The environment variable {name} decides: it is {value}": (
        "Die Umgebungsvariable {name} entscheidet: Sie ist {value}"
    ),
    "Shortcuts in the 3D View": "Tastenkürzel in der 3D-Ansicht",
    # The panel of a character
    "Sinew": "Sinew",
    "Skinning of the selected character": "Skinning der ausgewählten Figur",
    "Stages and Settings": "Stufen und Einstellungen",
    "What follows the method, and whose settings count": (
        "Was der Methode folgt, und wessen Einstellungen gelten"
    ),
    "Methods beside each other, and which one suits the character": (
        "Methoden nebeneinander, und welche zur Figur passt"
    ),
    "A measure of the deformation as colours, and where it is worst": (
        "Ein Maß der Verformung als Farben, und wo es am schlechtesten ist"
    ),
    "Faults of weights and poses": "Fehler von Gewichtungen und Posen",
    "Animation": "Animation",
    "In-betweens, blends of actions and inverse kinematics": (
        "Zwischenbilder, gemischte Aktionen und inverse Kinematik"
    ),
    "Shapes as data that plays without Sinew": "Formen als Daten, die ohne Sinew abspielen",
    "What one does most often while posing": "Was man beim Posieren am häufigsten tut",
    "Add": "Hinzufügen",
    "Add Sinew": "Sinew hinzufügen",
    "Add Sinew to {count} Mesh": "Sinew zu {count} Masche hinzufügen",
    "Add Sinew to {count} Meshes": "Sinew zu {count} Maschen hinzufügen",
    "Deform all meshes of the armature with Sinew, in the place of their Armature modifiers. Those "
    "stay in the stack, switched off": (
        "Alle Maschen des Skeletts mit Sinew verformen, anstelle ihrer Skelett-Modifikatoren. Diese "
        "bleiben ausgeschaltet im Stapel"
    ),
    "What to start with": "Womit begonnen wird",
    "As the Armature modifier is set": "Wie der Skelett-Modifikator eingestellt ist",
    "Each mesh keeps its shape; one that joins others has their settings": (
        "Jede Masche behält ihre Form; eine, die zu anderen hinzukommt, bekommt deren Einstellungen"
    ),
    "Rebind": "Binden",
    "Read meshes, weights and bones anew, and switch on again after an error": (
        "Maschen, Gewichtungen und Knochen neu lesen und nach einem Fehler wieder einschalten"
    ),
    "Remove": "Entfernen",
    "Remove Sinew": "Sinew entfernen",
    "Take Sinew off all meshes of the character and give their Armature modifiers back as they were": (
        "Sinew von allen Maschen der Figur nehmen und ihre Skelett-Modifikatoren zurückgeben, wie sie waren"
    ),
    "Switch On / Off": "Ein / Aus schalten",
    "Flip all meshes of the character between Sinew and Blender's Armature modifier, to compare the two": (
        "Alle Maschen der Figur zwischen Sinew und Blenders Skelett-Modifikator umschalten, um beide zu "
        "vergleichen"
    ),
    "Sinew is on": "Sinew ist an",
    "Sinew is off": "Sinew ist aus",
    "Use Method": "Methode verwenden",
    "Deform all meshes of the character by this method": (
        "Alle Maschen der Figur mit dieser Methode verformen"
    ),
    "Method {name}: choose one of {names}": "Methode {name}: Wähle eine von {names}",
    "Its short name, as in the table of methods": "Ihr kurzer Name wie in der Tabelle der Methoden",
    "Open the Sinew Tab": "Reiter Sinew öffnen",
    "Show the tab Sinew in the sidebar of the 3D view": (
        "Den Reiter Sinew in der Seitenleiste der 3D-Ansicht zeigen"
    ),
    "This window has no 3D view": "Dieses Fenster hat keine 3D-Ansicht",
    "{count} mesh": "{count} Masche",
    "{count} meshes": "{count} Maschen",
    "All {count} meshes": "Alle {count} Maschen",
    "{names} and {count} more": "{names} und {count} weitere",
    "Sinew deforms": "Sinew verformt",
    "Rebound": "Neu gebunden:",
    "Removed Sinew from": "Sinew entfernt von",
    "Took over Corrective Smooth of": "Corrective Smooth übernommen von",
    "Made the vertex group of": "Punktgruppe angelegt für",
    "The meshes of the armature have Sinew already": "Die Maschen des Skeletts haben Sinew schon",
    "{name} is no mesh: Sinew deforms meshes only": "{name} ist keine Masche: Sinew verformt nur Maschen",
    "{name} is no mesh that Sinew deforms": "{name} ist keine Masche, die Sinew verformt",
    "The active object": "Das aktive Objekt",
    "{name} stays with its Armature modifier: Sinew deforms meshes only": (
        "{name} bleibt bei seinem Skelett-Modifikator: Sinew verformt nur Maschen"
    ),
    "Select a mesh that an armature deforms, or the armature": (
        "Wähle eine Masche aus, die ein Skelett verformt, oder das Skelett"
    ),
    "Select a mesh with an Armature modifier, or an armature that deforms one": (
        "Wähle eine Masche mit einem Skelett-Modifikator aus oder ein Skelett, das eine verformt"
    ),
    "Select a mesh that Sinew deforms, or its armature": (
        "Wähle eine Masche aus, die Sinew verformt, oder ihr Skelett"
    ),
    "Wait for the end of the render": "Warte auf das Ende des Renderns",
    "{wait}: until then nothing can be changed": "{wait}: Bis dahin lässt sich nichts ändern",
    "The meshes differ: {names}. A method that you choose goes to all": (
        "Die Maschen unterscheiden sich: {names}. Eine gewählte Methode gilt für alle"
    ),
    "Lock Interface Before Rendering": "Oberfläche beim Rendern sperren",
    "Restart Blender to use Sinew": "Starte Blender neu, um Sinew zu verwenden",
    # Presets
    "Add Method Preset": "Voreinstellung hinzufügen",
    "Keep the method, its parameters and the stages under a name, or remove that preset": (
        "Methode, Parameter und Stufen unter einem Namen behalten oder diese Voreinstellung entfernen"
    ),
    "Use Method Preset": "Voreinstellung verwenden",
    "Set the character to this method, with its parameters and stages": (
        "Die Figur auf diese Methode mit ihren Parametern und Stufen einstellen"
    ),
    "File": "Datei",
    "The preset": "Die Voreinstellung",
    "Menu": "Menü",
    "The one that shows its name": "Das, welches ihren Namen zeigt",
    "Method Presets": "Voreinstellungen für Methoden",
    "Save Method as Preset…": "Methode als Voreinstellung sichern…",
    # Stages in the panel
    "Stages and Scale": "Stufen, Skala",
    "{count} stage": "{count} Stufe",
    "{count} stages": "{count} Stufen",
    "By": "Nach",
    "Choose the vertex group that says where it takes over": (
        "Wähle die Punktgruppe, die sagt, wo sie übernimmt"
    ),
    "Make a Vertex Group": "Punktgruppe anlegen",
    "Make Vertex Group": "Punktgruppe anlegen",
    "Make Vertex Group {name}": "Punktgruppe {name} anlegen",
    "Make the vertex group that says where the stage acts, and choose it. The shape stays as it is "
    "until you paint: for a mix it has no weights, for other stages all": (
        "Die Punktgruppe anlegen, die sagt, wo die Stufe wirkt, und sie wählen. Die Form bleibt, bis du "
        "malst: Zum Mischen hat sie keine Gewichtungen, für andere Stufen alle"
    ),
    "There is no stage {name}": "Es gibt keine Stufe {name}",
    "Make Vertex Group of the Mix": "Punktgruppe zum Mischen anlegen",
    "Make Vertex Group of Limit Bulge": "Punktgruppe für Wölbung begrenzen anlegen",
    "Make Vertex Group of Delta Mush": "Punktgruppe für Delta Mush anlegen",
    "Switch Sinew on first": "Schalte zuerst Sinew ein",
    "Take Over Corrective Smooth": "Corrective Smooth übernehmen",
    "Have Delta Mush smooth in the place of the Corrective Smooth modifier, by its settings. It stays "
    "in the stack, switched off, until Sinew is removed": (
        "Delta Mush anstelle des Modifikators Corrective Smooth glätten lassen, mit dessen "
        "Einstellungen. Er bleibt ausgeschaltet im Stapel, bis Sinew entfernt wird"
    ),
    # Meshes
    "Mesh": "Masche",
    "Meshes": "Maschen",
    "Let this mesh differ: it keeps settings of its own, which can have keys, and the character's do "
    "not change it. Once more: it follows the character again": (
        "Diese Masche abweichen lassen: Sie behält eigene Einstellungen, die Schlüsselbilder haben "
        "können, und die der Figur ändern sie nicht. Noch einmal: Sie folgt wieder der Figur"
    ),
    "Own Settings of This Mesh": "Eigene Einstellungen dieser Masche",
    "{name}: without Sinew, its Armature modifier deforms it": (
        "{name}: ohne Sinew, ihr Skelett-Modifikator verformt sie"
    ),
    "Vertices": "Punkte",
    "Bones": "Knochen",
    "{bones}, {weighted} with weights": "{bones}, {weighted} mit Gewichtungen",
    "Influences": "Einflüsse",
    "{mean} a vertex, at most {most}": "{mean} je Punkt, max. {most}",
    "Last frame": "Letztes Bild",
    # Who deforms a mesh, and why
    "{method} in the place of {modifiers}": "{method} anstelle von {modifiers}",
    "Off: {modifiers} deforms it": "Aus: {modifiers} verformt sie",
    "Off, and so is {modifiers} in the viewport": "Aus, und im Ansichtsfenster auch {modifiers}",
    "Hidden by its modifier's icons": "Durch die Symbole seines Modifikators verborgen",
    "Hidden in the viewport by its modifier's icon": (
        "Im Ansichtsfenster durch das Symbol seines Modifikators verborgen"
    ),
    "Hidden in renders by its modifier's icon": "Beim Rendern durch das Symbol seines Modifikators verborgen",
    "Its Armature modifier deforms: its icons are on": (
        "Ihr Skelett-Modifikator verformt sie: Seine Symbole sind an"
    ),
    "Its Armature modifier deforms in the viewport: its icon is on": (
        "Im Ansichtsfenster verformt sie ihr Skelett-Modifikator: Sein Symbol ist an"
    ),
    "Its Armature modifier deforms in renders: its icon is on": (
        "Beim Rendern verformt sie ihr Skelett-Modifikator: Sein Symbol ist an"
    ),
    "Its Armature modifier was off before Sinew; Remove switches it off again": (
        "Ihr Skelett-Modifikator war vor Sinew aus; Entfernen schaltet ihn wieder aus"
    ),
    "Its baked shape keys are muted; Remove unmutes them": (
        "Ihre gebackenen Formschlüssel sind stumm; Entfernen schaltet sie wieder ein"
    ),
    "{names} plays baked shapes, and is off; Remove switches it on again": (
        "{names} spielt gebackene Formen ab und ist aus; Entfernen schaltet ihn wieder an"
    ),
    "Its shape keys are animated and deform it, too: mute those that are a bake": (
        "Ihre Formschlüssel sind animiert und verformen sie auch: Schalte die stumm, die gebacken sind"
    ),
    "{modifiers} deforms it until the next frame": "Bis zum nächsten Einzelbild verformt sie {modifiers}",
    "{text}, after Blender's evaluation: {reason}": "{text}, nach Blenders Auswertung: {reason}",
    "Blender computes normals: {reason}": "Blender berechnet die Normalen: {reason}",
    "{names}: warnings, see Meshes": "{names}: Warnungen, siehe Maschen",
    "Blender did not request the points": "Blender hat die Punkte nicht angefordert",
    "{count} times not deformed within Blender's evaluation; last: {failure}": (
        "{count} mal nicht in Blenders Auswertung verformt; zuletzt: {failure}"
    ),
    "Linked from another file: its Armature modifier deforms it; make a library override to use Sinew": (
        "Aus einer anderen Datei verknüpft: Ihr Skelett-Modifikator verformt sie; überschreibe die "
        "Bibliothek, um Sinew zu verwenden"
    ),
    "In this mode the Armature modifier deforms it": "In diesem Modus verformt sie der Skelett-Modifikator",
    "The visibility of its Armature modifier is animated: in this mode that shows its own shape": (
        "Die Sichtbarkeit ihres Skelett-Modifikators ist animiert: In diesem Modus zeigt er seine eigene Form"
    ),
    "Small: the Armature modifier has the same shape in less time, and deforms it": (
        "Klein: Der Skelett-Modifikator hat die gleiche Form in weniger Zeit und verformt sie"
    ),
    "Safe mode": "Sicherer Modus",
    "A copy for comparison": "Eine Kopie zum Vergleich",
    "Modifiers in front of the Armature modifier change weights": (
        "Modifikatoren vor dem Skelett-Modifikator ändern Gewichtungen"
    ),
    "It shows a heat map": "Sie zeigt eine Wärmekarte",
    "The visibility of its Armature modifier is animated": (
        "Die Sichtbarkeit ihres Skelett-Modifikators ist animiert"
    ),
    "An Armature modifier is on in the viewport or in renders alone": (
        "Ein Skelett-Modifikator ist nur im Ansichtsfenster oder nur beim Rendern an"
    ),
    "it shows a heat map": "sie zeigt eine Wärmekarte",
    "it has instances on its vertices or faces": "sie hat Instanzen auf ihren Punkten oder Flächen",
    "another object reads its mesh": "ein anderes Objekt liest ihre Masche",
    "{name} is in front": "{name} ist davor",
    "{name} follows": "{name} folgt",
    "{bare} of {count} vertices have no weights and stay at rest": (
        "{bare} von {count} Punkten haben keine Gewichtungen und bleiben in Ruhe"
    ),
    "Groups without a bone: {names}": "Gruppen ohne Knochen: {names}",
    "The mesh lacks the shape keys {first}, {second} and {third}: all vertices are blended linearly": (
        "Der Masche fehlen die Formschlüssel {first}, {second} und {third}: Alle Punkte werden linear "
        "gemischt"
    ),
    "The mesh has no faces, which {method} needs: its vertices are blended linearly": (
        "Die Masche hat keine Flächen, die {method} braucht: Ihre Punkte werden linear gemischt"
    ),
    "mmd_tools deforms a part of this mesh by its shape key {name}: unbind its SDEF, then Sinew "
    "deforms all of it": (
        "mmd_tools verformt einen Teil dieser Masche mit ihrem Formschlüssel {name}: Löse dessen SDEF, "
        "dann verformt Sinew sie ganz"
    ),
    "no vertex group {name}": "Keine Punktgruppe {name}",
    "no vertex group is chosen": "Keine Punktgruppe gewählt",
    "{missing} for the mix: nothing is mixed": "{missing} zum Mischen: Es wird nichts gemischt",
    "{missing} for {stage}: it acts everywhere": "{missing} für {stage}: Es wirkt überall",
    "{name}: behind Sinew's modifier, Blender moves other vertices than those assigned to this Hook; "
    "give it a vertex group": (
        "{name}: Hinter Sinews Modifikator bewegt Blender andere Punkte als die, die diesem Haken "
        "zugewiesen sind; gib ihm eine Punktgruppe"
    ),
    "{name}: behind Sinew's modifier, Blender puts these particles and hairs elsewhere on the mesh; "
    "emit them from vertices, from another mesh, or leave this mesh to its Armature modifier": (
        "{name}: Hinter Sinews Modifikator setzt Blender diese Partikel und Haare an andere Stellen der "
        "Masche; lass sie von Punkten oder von einer anderen Masche ausgehen, oder überlass diese Masche "
        "ihrem Skelett-Modifikator"
    ),
    "{name}: behind Sinew's modifier, Blender does not use the Rest Shape Key of this Cloth as it "
    "should; leave this mesh to its Armature modifier": (
        "{name}: Hinter Sinews Modifikator benutzt Blender den Ruheformschlüssel dieses Stoffs nicht, wie "
        "es sollte; überlass diese Masche ihrem Skelett-Modifikator"
    ),
    "Armature modifiers apart from the first stay Blender's: {names}; move them right behind it to "
    "have Sinew deform by them": (
        "Skelett-Modifikatoren abseits des ersten bleiben bei Blender: {names}; rücke sie direkt hinter "
        "ihn, damit Sinew sie übernimmt"
    ),
    "no Corrective Smooth behind its Armature modifier is on": (
        "kein Corrective Smooth hinter ihrem Skelett-Modifikator ist an"
    ),
    "{name} stays Blender's: {reason}": "{name} bleibt bei Blender: {reason}",
    "its Rest Source is not Original Coords, but a shape of its own": (
        "seine Ruhequelle sind nicht die ursprünglichen Koordinaten, sondern eine eigene Form"
    ),
    "{names} between it and the Armature modifier": "{names} zwischen ihm und dem Skelett-Modifikator",
    "it is on in the viewport or in renders alone": "er ist nur im Ansichtsfenster oder nur beim Rendern an",
    "its settings are animated": "seine Einstellungen sind animiert",
    "{names} beyond what Delta Mush takes": "{names} außerhalb dessen, was Delta Mush annimmt",
    "modifiers in front make other vertices, which it does not smooth": (
        "Modifikatoren davor machen andere Punkte, die Delta Mush nicht glättet"
    ),
    "Delta Mush is on already": "Delta Mush ist schon an",
    # Precomputation
    "Without its {what} it has the Armature modifier's shape: finding them was stopped": (
        "Ohne {what} hat sie die Form des Skelett-Modifikators: Die Suche wurde angehalten"
    ),
    "It has the Armature modifier's shape until its {what} are found": (
        "Bis {what} gefunden sind, hat sie die Form des Skelett-Modifikators"
    ),
    "Watch Precomputation": "Vorberechnung verfolgen",
    "Show in the status bar how far precomputations are; Esc stops them": (
        "In der Statusleiste zeigen, wie weit Vorberechnungen sind; Esc hält sie an"
    ),
    "Stop": "Anhalten",
    "Stop computing what the method needs; the Armature modifier's shape stays": (
        "Nicht weiter berechnen, was die Methode braucht; die Form des Skelett-Modifikators bleibt"
    ),
    "Compute": "Berechnen",
    "Compute what the method needs of this mesh": "Berechnen, was die Methode von dieser Masche braucht",
    "Stopped; the Sinew tab has a button to go on": (
        "Angehalten; im Reiter Sinew geht es mit einem Knopf weiter"
    ),
    "Finding {what}: {share}": "Suche {what}: {share}",
    "Finding {what} of {count} meshes: {share}": "Suche {what} von {count} Maschen: {share}",
    "Find {what}": "{what} suchen",
    "Sinew computes what its methods need: {share} (Esc stops)": (
        "Sinew berechnet, was seine Methoden brauchen: {share} (Esc hält an)"
    ),
    # What goes through frames
    "Over": "Über",
    "The frames to go through": "Die Einzelbilder, die durchlaufen werden",
    "Scene's Frames": "Einzelbilder der Szene",
    "The scene's frame range, or its preview range where that is on": (
        "Der Bildbereich der Szene, oder ihr Vorschaubereich, wo dieser an ist"
    ),
    "Action's Frames": "Einzelbilder der Aktion",
    "From the first to the last key of the armature's action": (
        "Vom ersten bis zum letzten Schlüsselbild der Aktion des Skeletts"
    ),
    "Sinew goes through frames": "Sinew durchläuft Einzelbilder",
    "Stopped; nothing has changed": "Angehalten; nichts hat sich geändert",
    "{doing}: {share} (Esc stops)": "{doing}: {share} (Esc hält an)",
    # Suggest
    "Suggest": "Vorschlagen",
    "Suggest a Method": "Methode vorschlagen",
    "Suggest a Method over the Scene's Frames": "Methode vorschlagen, über die Szene",
    "Suggest a Method over the Action's Frames": "Methode vorschlagen, über die Aktion",
    "Measure what every method would make of the frames, and say which is best at what. The method "
    "stays as it is": (
        "Messen, was jede Methode aus den Einzelbildern machen würde, und sagen, welche worin die beste "
        "ist. Die Methode bleibt, wie sie ist"
    ),
    "Sinew measures every method": "Sinew misst jede Methode",
    "Measure All Methods": "Alle Methoden messen",
    "The worst of {count} frame": "Der schlechteste Wert von {count} Einzelbild",
    "The worst of {count} frames": "Der schlechteste Wert von {count} Einzelbildern",
    "Suggestions by Measure": "Vorschläge nach Maß",
    "Show the best methods at each measure, or all methods in the order of one": (
        "Die besten Methoden je Maß zeigen, oder alle Methoden in der Reihenfolge eines Maßes"
    ),
    "Best at Each Measure": "Beste je Maß",
    "What the methods are compared by": "Wonach die Methoden verglichen werden",
    "The best methods at each measure, with their worst value": (
        "Die besten Methoden je Maß, mit ihrem schlechtesten Wert"
    ),
    "and {count} more": "und {count} weitere",
    "All alike": "Alle gleich",
    "Stretch": "Dehnung",
    "How evenly edges keep their length (RMS)": "Wie gleichmäßig Kanten ihre Länge behalten (RMS)",
    "Volume": "Volumen",
    "How far the volume is from that at rest": "Wie weit das Volumen von dem in Ruhe abweicht",
    "How far a vertex leaves or nears its bone's axis": (
        "Wie weit sich ein Punkt von der Achse seines Knochens entfernt oder ihr nähert"
    ),
    "Flips": "Falten",
    "How much of the surface is folded over": "Wie viel der Oberfläche umgeklappt ist",
    "Crossings": "Schnitte",
    "How many triangles cross others that they do not at rest": (
        "Wie viele Dreiecke andere durchdringen, die sie in Ruhe nicht durchdringen"
    ),
    # Inverse kinematics
    "Bake Sinew IK": "Sinew-IK backen",
    "Bake Sinew IK\u2026": "Sinew-IK backen\u2026",
    "Solve the IK constraints of the selected bones' chains, or of all, by Sinew, and key the result in "
    "a copy of the action; the constraints are muted until Original Action": (
        "Die IK-Zwänge der Ketten der ausgewählten Knochen, oder alle, durch Sinew lösen und das Ergebnis in "
        "einer Kopie der Aktion mit Schlüsselbildern versehen; bis Ursprüngliche Aktion sind die Zwänge stumm"
    ),
    "Original Action": "Ursprüngliche Aktion",
    "Play the action that was there before Sinew keyed a copy, with its IK constraints; the copy goes": (
        "Die Aktion abspielen, die vor Sinews Kopie da war, mit ihren IK-Zwängen; die Kopie verschwindet"
    ),
    "Sinew has keyed no copy of this armature's action": (
        "Sinew hat keine Kopie der Aktion dieses Skeletts erstellt"
    ),
    "Whether it is a copy with keys of Sinew": "Ob es eine Kopie mit Schlüsselbildern von Sinew ist",
    "The action before": "Die Aktion davor",
    "The pose before": "Die Pose davor",
    "The IK constraints that are muted meanwhile": "Die IK-Zwänge, die derweil stumm sind",
    "Sinew solves inverse kinematics": "Sinew löst inverse Kinematik",
    "How the rotations are found": "Wie die Drehungen gefunden werden",
    "Damped least squares": "Gedämpfte kleinste Quadrate",
    "A few steps of all bones at once; the faster one nearly always": (
        "Wenige Schritte aller Knochen zugleich; fast immer das schnellere"
    ),
    "Cyclic descent": "Zyklischer Abstieg",
    "One bone after the other from the tip: bends most near the tip": (
        "Ein Knochen nach dem anderen von der Spitze an: beugt am meisten nahe der Spitze"
    ),
    "Select an armature": "Ein Skelett auswählen",
    "{count} bones keyed; the tips are at most {share} of a chain's length off": (
        "{count} Knochen mit Schlüsselbildern; die Spitzen liegen höchstens {share} einer Kettenlänge daneben"
    ),
    # In-betweens
    "How the bones move between the keyed poses of the action": (
        "Wie sich die Knochen zwischen den Schlüsselposen der Aktion bewegen"
    ),
    "Straight rotation, even pace (recommended)": "Gerade Drehung, gleichmäßig (empfohlen)",
    "The shortest rotation at an even pace, rigid; location goes straight. QV with slerp": (
        "Die kürzeste Drehung mit gleichmäßigem Tempo, starr; die Position geht geradeaus. QV mit Slerp"
    ),
    "Straight rotation, smooth on splines": "Gerade Drehung, weich auf Splines",
    "The shortest rotation at a slightly uneven pace, rigid; location goes straight. QV with nlerp": (
        "Die kürzeste Drehung mit leicht ungleichmäßigem Tempo, starr; die Position geht geradeaus. QV "
        "mit Nlerp"
    ),
    "Screw, even pace": "Schraubung, gleichmäßig",
    "The screw from key to key: a bone that rotates and moves swings along an arc. ScLERP of dual "
    "quaternions": (
        "Die Schraubung von Schlüsselbild zu Schlüsselbild: Ein Knochen, der sich dreht und bewegt, "
        "schwingt auf einem Bogen. ScLERP dualer Quaternionen"
    ),
    "Nearly a screw, smooth on splines": "Fast eine Schraubung, weich auf Splines",
    "Dual quaternions blended linearly, at a slightly uneven pace. DLB": (
        "Duale Quaternionen linear gemischt, mit leicht ungleichmäßigem Tempo. DLB"
    ),
    "Screw, keys blended iteratively": "Schraubung, Schlüssel iterativ gemischt",
    "The screw between two keys; on a spline, all keys blended iteratively. DIB of dual quaternions": (
        "Die Schraubung zwischen zwei Schlüsselbildern; auf einem Spline werden alle iterativ gemischt. "
        "DIB dualer Quaternionen"
    ),
    "Straight matrix, made rigid": "Gerade Matrix, starr gemacht",
    "Matrices component by component, brought back to the nearest rotation. Polar decomposition": (
        "Matrizen Wert für Wert, zurückgeführt auf die nächste Drehung. Polarzerlegung"
    ),
    "Logarithms, not the shortest way": "Logarithmen, nicht der kürzeste Weg",
    "Logarithms of matrices: dependent on the rest pose. Log-matrix blending": (
        "Logarithmen von Matrizen: abhängig von der Ruhepose. Log-Matrix-Mischung"
    ),
    "Straight matrix, not rigid": "Gerade Matrix, nicht starr",
    "Matrices component by component: bones grow thin between keys rotated far from each other": (
        "Matrizen Wert für Wert: Knochen werden dünn zwischen Schlüsselbildern, die weit gegeneinander "
        "gedreht sind"
    ),
    "Path": "Pfad",
    "Which keyed poses shape the way from one to the next": (
        "Welche Schlüsselposen den Weg von einer zur nächsten formen"
    ),
    "Key to Key": "Von Pose zu Pose",
    "The two neighbours, at the pace of the keys' own interpolation": (
        "Die beiden Nachbarn, im Tempo der Interpolation der Schlüsselbilder"
    ),
    "Spline": "Spline",
    "Catmull-Rom through four keyed poses: smooth at keys, at the spline's pace": (
        "Catmull-Rom durch vier Schlüsselposen: weich an Schlüsselbildern, im Tempo des Splines"
    ),
    "Bake In-betweens": "Zwischenbilder backen",
    "Bake In-betweens\u2026": "Zwischenbilder backen\u2026",
    "Sinew keys in-betweens": "Sinew macht Zwischenbilder",
    "Move the selected bones, or all, between the keyed poses of their action by another method than curves, "
    "by plain keys in a copy of the action": (
        "Die ausgewählten Knochen, oder alle, zwischen den Schlüsselposen ihrer Aktion nach einer anderen "
        "Methode als Kurven bewegen, durch gewöhnliche Schlüsselbilder in einer Kopie der Aktion"
    ),
    "Step": "Schritt",
    "Frames from one baked key to the next": "Einzelbilder von einem gebackenen Schlüsselbild zum nächsten",
    "rotates by 180 degrees or more from key to key, and takes the shorter way: key in between": (
        "dreht sich zwischen zwei Schlüsselbildern um 180 Grad oder mehr und nimmt den kürzeren Weg: "
        "Setze eines dazwischen"
    ),
    "rotates too far for this spline, and may jump: key in between, or choose one that is smooth on "
    "splines": (
        "dreht sich zu weit für diesen Spline und könnte springen: Setze ein Schlüsselbild dazwischen, "
        "oder wähle eine Methode, die auf Splines weich ist"
    ),
    "{count} bones into {action}": "{count} Knochen in {action}",
    # Blends of actions
    "Action": "Aktion",
    "An action that moves bones of this armature": "Eine Aktion, die Knochen dieses Skeletts bewegt",
    "Weight": "Gewicht",
    "How much of the action is in the blend; weights are brought to sum 1": (
        "Wie viel von der Aktion in der Mischung ist; Gewichte werden auf die Summe 1 gebracht"
    ),
    "At First": "Anfangs",
    "How much of the action is in the blend before its weights change": (
        "Wie viel von der Aktion in der Mischung ist, bevor ihre Gewichte sich ändern"
    ),
    "The actions to blend": "Die Aktionen, die gemischt werden",
    "How poses of a bone are blended": "Wie Posen eines Knochens gemischt werden",
    "Dual Quaternions (recommended)": "Duale Quaternionen (empfohlen)",
    "Normalised sum: rigid, nearly a screw. DLB": "Normierte Summe: starr, fast eine Schraubung. DLB",
    "Screw": "Schraubung",
    "The screw between two, at an even pace; of more as DIB. ScLERP": (
        "Die Schraubung zwischen zweien, gleichmäßig; von mehreren wie DIB. ScLERP"
    ),
    "Screw of Many": "Schraubung von vielen",
    "Dual quaternions blended iteratively, evenly. DIB": (
        "Duale Quaternionen, iterativ und gleichmäßig gemischt. DIB"
    ),
    "Quaternion and Vector": "Quaternion und Vektor",
    "Normalised sum of rotations, mean location: rigid": (
        "Normierte Summe der Drehungen, mittlere Position: starr"
    ),
    "Quaternion and Vector, Even": "Quaternion und Vektor, gleichmäßig",
    "Mean rotation on the sphere, mean location": "Mittlere Drehung auf der Kugel, mittlere Position",
    "Matrix Made Rigid": "Matrix, starr gemacht",
    "Mean matrix, brought back to the nearest rotation": (
        "Mittlere Matrix, zurückgeführt auf die nächste Drehung"
    ),
    "Mean of logarithms: rigid, dependent on the rest pose": (
        "Mittel der Logarithmen: starr, abhängig von der Ruhepose"
    ),
    "Linear Matrix": "Matrix, linear",
    "Mean matrix: bones shrink where clips differ": (
        "Mittlere Matrix: Knochen schrumpfen, wo Aktionen sich unterscheiden"
    ),
    "Space": "Raum",
    "Relative to what bones are blended": "Relativ wozu Knochen gemischt werden",
    "Parents": "Eltern",
    "Each bone relative to its parent: chains stay whole": (
        "Jeder Knochen relativ zu seinem Elternknochen: Ketten bleiben ganz"
    ),
    "Each bone by itself: it keeps its direction, and bones that are not connected leave their parents": (
        "Jeder Knochen für sich: Er behält seine Richtung, und nicht verbundene Knochen lösen "
        "sich von ihren Eltern"
    ),
    "Align": "Angleichen",
    "Bring the actions to the same moment of their motion, and cycles to a common length; else "
    "each plays from its first frame": (
        "Bringt die Aktionen zum selben Moment ihrer Bewegung und Zyklen auf eine gemeinsame "
        "Länge; sonst spielt jede von ihrem ersten Einzelbild an"
    ),
    "Aligned by": "Angeglichen nach",
    "The bone that says which moment it is, such as a foot; empty: all bones": (
        "Der Knochen, der sagt, welcher Moment es ist, etwa ein Fuß; leer: alle Knochen"
    ),
    "Change Weights": "Gewichte ändern",
    "Let the weights change in the course of the blend": (
        "Lässt die Gewichte sich im Lauf der Mischung ändern"
    ),
    "Begins At": "Beginnt bei",
    "The share of the motion after which weights change": (
        "Der Anteil der Bewegung, nach dem sich Gewichte ändern"
    ),
    "Ends At": "Endet bei",
    "The share of the motion after which they have changed": (
        "Der Anteil der Bewegung, nach dem sie sich geändert haben"
    ),
    "Slow In and Out": "Langsam hinein und heraus",
    "Let the change of weights begin and end slowly; else it is even": (
        "Lässt die Änderung der Gewichte langsam beginnen und enden; sonst ist sie gleichmäßig"
    ),
    "Cycles": "Zyklen",
    "How often actions that repeat go round in the blend": (
        "Wie oft Aktionen, die sich wiederholen, in der Mischung durchlaufen"
    ),
    "Root Motion": "Wurzelbewegung",
    "What becomes of the way that the root goes over the ground": (
        "Was aus dem Weg wird, den die Wurzel über den Boden geht"
    ),
    "Blended": "Gemischt",
    "Steps of the root are blended and added up: speeds and turns blend": (
        "Schritte der Wurzel werden gemischt und aufsummiert: Tempo und Wendungen mischen sich"
    ),
    "In Place": "Auf der Stelle",
    "The way over the ground is taken out": "Der Weg über den Boden wird herausgenommen",
    "As Keyed": "Wie gesetzt",
    "The root is blended as any other bone": "Die Wurzel wird wie jeder andere Knochen gemischt",
    "Root": "Wurzel",
    "The bone that carries the others; empty: the uppermost that moves": (
        "Der Knochen, der die anderen trägt; leer: der oberste, der sich bewegt"
    ),
    "Add Action": "Aktion hinzufügen",
    "There is no such action in the blend": "Diese Aktion gibt es in der Mischung nicht",
    "Add an action to the blend: the one that plays, or the next that moves these bones": (
        "Fügt der Mischung eine Aktion hinzu: die abgespielte oder die nächste, die diese Knochen bewegt"
    ),
    "Remove Action": "Aktion entfernen",
    "Take the action out of the blend; the action itself stays in the file": (
        "Nimmt die Aktion aus der Mischung; die Aktion selbst bleibt in der Datei"
    ),
    "Add Clip from File": "Clip aus Datei hinzufügen",
    "Add Clip to the Blend…": "Clip zur Mischung hinzufügen…",
    "Make actions of the animations in a BVH, glTF or FBX file whose bones have the same names "
    "and rest, and add them to the blend": (
        "Macht Aktionen aus den Animationen einer BVH-, glTF- oder FBX-Datei, deren Knochen "
        "gleich heißen und gleich ruhen, und fügt sie der Mischung hinzu"
    ),
    "Blend Actions": "Aktionen mischen",
    "Blend the actions into a new one of plain keys, which the armature plays; the actions "
    "themselves stay as they are": (
        "Mischt die Aktionen zu einer neuen aus gewöhnlichen Schlüsselbildern, die das Skelett "
        "abspielt; die Aktionen selbst bleiben, wie sie sind"
    ),
    "Sinew blends actions": "Sinew mischt Aktionen",
    "{count} frame": "{count} Einzelbild",
    "{count} frames": "{count} Einzelbilder",
    "Made {name}: {frames}": "{name} erstellt: {frames}",
    "{name} is linked: make a library override of it first": (
        "{name} ist verknüpft: Erstelle zuerst eine Bibliotheksüberschreibung"
    ),
    "Added {names}": "{names} hinzugefügt",
    "Add actions of this armature, such as a walk and a run": (
        "Füge Aktionen dieses Skeletts hinzu, etwa Gehen und Laufen"
    ),
    "Select an armature, or a mesh that it deforms": "Wähle ein Skelett oder eine Masche, die es verformt",
    "Add two actions or more in the panel Blend Actions": (
        "Füge im Panel Aktionen mischen zwei oder mehr Aktionen hinzu"
    ),
    # Corrective shape keys
    "Corrective Shape Key": "Korrigierender Formschlüssel",
    "Corrective Shape Key Driven by the Bone": "Korrigierender Formschlüssel, vom Knochen getrieben",
    "Add a shape key by which the Armature modifier alone has the shape that Sinew shows in this pose. "
    "It is muted, as Sinew's shape has it already": (
        "Einen Formschlüssel hinzufügen, mit dem der Skelettmodifikator allein die Form hat, die Sinew in "
        "dieser Pose zeigt. Er ist stummgeschaltet, da Sinews Form ihn schon enthält"
    ),
    "Driven by the Active Bone": "Vom aktiven Knochen getrieben",
    "The key grows as the active pose bone turns against its parent, from rest to this pose": (
        "Der Schlüssel wächst, wie sich der aktive Posenknochen gegen seinen Elternknochen dreht, von der "
        "Ruhestellung bis zu dieser Pose"
    ),
    "{name}: {key} is there, and muted; the Armature modifier is {before} off without it, {after} with it": (
        "{name}: {key} ist da und stummgeschaltet; der Skelettmodifikator liegt ohne ihn {before} daneben, "
        "mit ihm {after}"
    ),
    # Edit and sculpt mode
    "It has no {method} with these settings: what you see here is another shape": (
        "{method} mit diesen Einstellungen hat er nicht: was hier zu sehen ist, ist eine andere Form"
    ),
    "Switch Preserve Volume to see {method} here, too": (
        "Volumenerhalt umschalten, um {method} auch hier zu sehen"
    ),
    "The shape is the same: {method}": "Die Form ist dieselbe: {method}",
    "The shape is the same: {method}. Preserve Volume is switched for it meanwhile": (
        "Die Form ist dieselbe: {method}. Volumenerhalt ist so lange dafür umgeschaltet"
    ),
    # Lesson
    "Open the Lesson": "Die Lektion öffnen",
    "Sinew Lesson": "Sinew-Lektion",
    "Open a file with an arm, a hand and a page that shows in ten minutes what Sinew does": (
        "Eine Datei mit einem Arm, einer Hand und einer Seite öffnen, die in zehn Minuten zeigt, was Sinew "
        "tut"
    ),
    "Save this file first: the lesson takes its place": (
        "Erst diese Datei speichern: die Lektion tritt an ihre Stelle"
    ),
    # Bake
    "Baked {names}": "Gebacken: {names}",
    "Bake": "Backen",
    "Bake…": "Backen…",
    "Bake Error": "Backfehler",
    "Show Bake Error": "Backfehler zeigen",
    "Hide Bake Error": "Backfehler verbergen",
    "Colour the meshes that were baked to bones by their distance from Sinew's shape, in 3D views in "
    "Solid shading. Switch it off before an export, which would write the colours": (
        "Die Maschen, die zu Knochen gebacken wurden, nach ihrem Abstand von Sinews Form färben, in "
        "3D-Ansichten mit der Schattierung Solide. Vor einem Export ausschalten, der die Farben schriebe"
    ),
    "Errors": "Fehler",
    "Which errors to show": "Welche Fehler gezeigt werden",
    "Before": "Vorher",
    "After": "Nachher",
    "Of the helper bones, over the frames of the bake": (
        "Die der Hilfsknochen, über die gebackenen Einzelbilder"
    ),
    "Of linear blending with the weights before the bake": (
        "Die der linearen Verformung mit den Gewichten vor dem Backen"
    ),
    "No colours; views are as they were": "Keine Farben; die Ansichten sind wie zuvor",
    "Select a mesh that was baked to bones": "Eine Masche auswählen, die zu Knochen gebacken wurde",
    "RMS {before} before, {after} after": "RMS {before} vorher, {after} nachher",
    "Dark violet is 0, yellow {end}: each vertex's RMS over the frames": (
        "Dunkelviolett ist 0, Gelb {end}: RMS jedes Punktes über die Einzelbilder"
    ),
    "Bake Shapes…": "Formen backen…",
    "Write what Sinew deforms as data that plays without it. A bake into this file takes Sinew off": (
        "Was Sinew verformt als Daten schreiben, die ohne Sinew abspielen. In dieser Datei nimmt das Backen "
        "Sinew herunter"
    ),
    "Takes Sinew off: what is baked plays without it": (
        "Nimmt Sinew herunter: Was gebacken ist, spielt ohne Sinew ab"
    ),
    "To": "Nach",
    "What plays the shapes: a modifier or shape keys of this file, or another program": (
        "Was die Formen abspielt: ein Modifikator oder Formschlüssel dieser Datei oder ein anderes Programm"
    ),
    "Shape Keys": "Formschlüssel",
    "One a frame, with keyed values, in this file": (
        "Einer je Einzelbild, mit Schlüsselbildern für die Werte, in dieser Datei"
    ),
    "MDD Cache": "MDD-Zwischenspeicher",
    "PC2 Cache": "PC2-Zwischenspeicher",
    "A point cache and a Mesh Cache modifier, in this file": (
        "Ein Zwischenspeicher der Punkte und ein Modifikator Mesh Cache, in dieser Datei"
    ),
    "Alembic": "Alembic",
    "USD": "USD",
    "glTF": "glTF",
    "The final meshes with UVs and materials; this file stays as it is": (
        "Die fertigen Maschen mit UVs und Materialien; diese Datei bleibt, wie sie ist"
    ),
    "The final meshes, the frames as morph targets; this file stays as it is": (
        "Die fertigen Maschen, die Einzelbilder als Morph-Ziele; diese Datei bleibt, wie sie ist"
    ),
    "Frames": "Einzelbilder",
    "Such as 1,12,40-48; empty: the scene's frames": "Etwa 1,12,40-48; leer: die Einzelbilder der Szene",
    "Every so many of the frames": "Jedes wievielte Einzelbild",
    "Folder": "Ordner",
    "Where files go; // is beside this file": "Wohin Dateien kommen; // ist neben dieser Datei",
    "Overwrite": "Überschreiben",
    "Replace files that are there already": "Dateien ersetzen, die schon da sind",
    "Helper bones and weights, in this file: what engines play": (
        "Hilfsknochen und Gewichte, in dieser Datei: was Spiele abspielen"
    ),
    "Helper Bones": "Hilfsknochen",
    "How many each armature gets at most; 0: two a joint": (
        "Wie viele jede Armatur höchstens bekommt; 0: zwei je Gelenk"
    ),
    "Error": "Fehler",
    "No more helper bones are added once the rms error is this much of the meshes' diagonal; "
    "0: all of them": (
        "Sobald der mittlere Fehler so viel der Diagonale der Maschen ist, kommen keine Hilfsknochen mehr "
        "hinzu; 0: alle"
    ),
    "How many bones move a vertex at most; most engines take four": (
        "Wie viele Knochen einen Punkt höchstens bewegen; die meisten Spiele nehmen vier"
    ),
    "{name}: {count} helper bones; error {rms} {unit} rms, {worst} at most ({shares} of the diagonal)"
    "; linear blending had {rms_before} and {worst_before}": (
        "{name}: {count} Hilfsknochen; Fehler im Mittel {rms} {unit}, höchstens {worst} ({shares} der "
        "Diagonale); lineares Überblenden hatte {rms_before} und {worst_before}"
    ),
    "In other poses, which they were not made from: {rms} {unit} rms, {worst} at most; linear blending has "
    "{rms_before} and {worst_before}": (
        "In anderen Posen, aus denen sie nicht gemacht wurden: im Mittel {rms} {unit}, höchstens {worst}; "
        "lineares Überblenden hat {rms_before} und {worst_before}"
    ),
    "Motion": "Bewegung",
    "Keys": "Schlüsselbilder",
    "Pose": "Pose",
    "What moves helper bones": "Was Hilfsknochen bewegt",
    "Plain keys over these frames, of bones that do not change size: for any engine": (
        "Schlüsselbilder über diese Einzelbilder, von Knochen gleicher Größe: für jedes Spiel"
    ),
    "Keys with Scale": "Schlüsselbilder mit Skalierung",
    "Helper bones also grow and shrink, and come nearer: for engines that play scale": (
        "Hilfsknochen wachsen und schrumpfen auch, und kommen näher: für Spiele, die Skalierung abspielen"
    ),
    "Constraints by which they follow the pose: other animation has them, too": (
        "Beschränkungen, durch die sie der Pose folgen: auch andere Animation hat sie"
    ),
    "Sinew bakes": "Sinew backt",
    "Bake stopped; nothing was written": "Backen angehalten; nichts wurde geschrieben",
    # glTF
    "Skinning Data": "Skinning-Daten",
    "Write for engines how Sinew deforms each mesh: its method, and the centres of rotation and the shares "
    "of the painted mix of its vertices": (
        "Für Engines schreiben, wie Sinew jede Masche verformt: ihre Methode, und die Drehzentren und die "
        "Anteile der gemalten Mischung ihrer Punkte"
    ),
    # Compare
    "Compare": "Vergleichen",
    "Compare…": "Vergleichen…",
    "Compare Methods…": "Methoden vergleichen…",
    "Methods…": "Methoden…",
    "Show live copies of the character beside it, one for each method, until End Comparison takes them "
    "away; renders leave them out": (
        "Lebendige Kopien der Figur neben ihr zeigen, eine je Methode, bis Vergleich beenden sie "
        "wegnimmt; beim Rendern fehlen sie"
    ),
    "Show": "Anzeigen",
    "Show a copy of the character under this method": "Eine Kopie der Figur mit dieser Methode zeigen",
    "Show a copy of the character under each of these": "Je eine Kopie der Figur mit diesen Methoden zeigen",
    "Show a copy under each of these": "Je eine Kopie zeigen mit",
    "As it stands in the stack, without Sinew": "Wie er im Stapel steht, ohne Sinew",
    "Choices": "Auswahl",
    "The same as check boxes, in the dialog": "Dasselbe als Kästchen, im Dialog",
    "Spacing": "Zwischenraum",
    "From one character to the next": "Von einer Figur zur nächsten",
    "Arrangement": "Anordnung",
    "Where the copies are shown": "Wo die Kopien gezeigt werden",
    "Side by Side": "Nebeneinander",
    "Each copy at a place of its own": "Jede Kopie an einem eigenen Platz",
    "Overlay": "Überlagern",
    "All copies at the first place beside the original": "Alle Kopien am ersten Platz neben dem Original",
    "Flip": "Umschalten",
    "One of two copies at a time, at the first place beside the original": (
        "Immer eine von zwei Kopien, am ersten Platz neben dem Original"
    ),
    "First Method": "Erste Methode",
    "The method that is shown before a flip": "Die Methode, die vor dem Umschalten gezeigt wird",
    "The method that is shown after a flip": "Die Methode, die nach dem Umschalten gezeigt wird",
    "Flip Comparison": "Vergleich umschalten",
    "Show the other of the two copies that are compared, at the same place": (
        "Die andere der beiden verglichenen Kopien zeigen, am gleichen Platz"
    ),
    "End Comparison": "Vergleich beenden",
    "Take the copies away, and all that was made for them": (
        "Die Kopien wegnehmen, und alles, was für sie angelegt wurde"
    ),
    "Compare methods first": "Vergleiche zuerst Methoden",
    "There is no comparison": "Es gibt keinen Vergleich",
    "Leave edit mode first": "Verlasse zuerst den Bearbeitungsmodus",
    "The copies were deleted": "Die Kopien wurden gelöscht",
    "Colour by Method": "Farbe nach Methode",
    "Render the Copies": "Die Kopien rendern",
    "Shown: {method}": "Gezeigt: {method}",
    "Original: {method}": "Original: {method}",
    "Another scene shows a comparison": "Eine andere Szene zeigt einen Vergleich",
    # Heat map
    "Heat Map": "Wärmekarte",
    "Show a measure of the deformation as colours of the mesh": (
        "Ein Maß der Verformung als Farben der Masche zeigen"
    ),
    "Show a measure of the deformation as colours, in Solid shading, in materials and in renders; once "
    "more: everything as it was": (
        "Ein Maß der Verformung als Farben zeigen, in der Darstellung Massiv, in Materialien und beim "
        "Rendern; noch einmal: alles wie zuvor"
    ),
    "Measure": "Maß",
    "What the heat map shows and worst frames are found by": (
        "Was die Wärmekarte zeigt und wonach die schlechtesten Einzelbilder gesucht werden"
    ),
    "Distance": "Abstand",
    "The distance of each vertex from its position under the reference method.": (
        "Der Abstand jedes Punktes von seiner Lage unter der Vergleichsmethode."
    ),
    "Bulge": "Wölbung",
    "How much farther from its bone's axis a vertex lies than at rest: above zero the limb swells, "
    "below zero it collapses.": (
        "Wie viel weiter ein Punkt von der Achse seines Knochens entfernt ist als in Ruhe: Über null "
        "schwillt das Glied an, unter null fällt es ein."
    ),
    "Edge stretch": "Dehnung der Kanten",
    "The length of a vertex's most changed edge, as a part of its length at rest.": (
        "Die Länge der am meisten veränderten Kante eines Punktes, als Teil ihrer Länge in Ruhe."
    ),
    "Area": "Flächeninhalt",
    "The area of the faces around a vertex, as a part of their area at rest.": (
        "Der Inhalt der Flächen um einen Punkt, als Teil ihres Inhalts in Ruhe."
    ),
    "Flipped faces": "Umgeklappt",
    "The share of a vertex's faces that are flipped against the bones that move them.": (
        "Der Anteil der Flächen eines Punktes, die gegen die sie bewegenden Knochen umgeklappt sind."
    ),
    "Compared with": "Verglichen mit",
    "What distances are measured to": "Wozu Abstände gemessen werden",
    "Range": "Bereich",
    "Which values the colours stand for": "Für welche Werte die Farben stehen",
    "Per Frame": "Je Einzelbild",
    "As wide as each frame's own values": "So weit wie die Werte jedes Einzelbilds",
    "Fixed": "Fixiert",
    "The same at all frames, so that frames compare": (
        "Bei allen Einzelbildern gleich, sodass man sie vergleichen kann"
    ),
    "Up to": "Bis",
    "The length that the last colour stands for": "Die Länge, für die die letzte Farbe steht",
    "The ratio that the last colour stands for; the first stands for one divided by it": (
        "Das Verhältnis, für das die letzte Farbe steht; die erste steht für eins geteilt durch dieses"
    ),
    "Fit": "Einpassen",
    "Fit to Frames": "An Einzelbilder anpassen",
    "Fit Heat Map over the Scene's Frames": "Wärmekarte an die Szene anpassen",
    "Fit Heat Map over the Action's Frames": "Wärmekarte an die Aktion anpassen",
    "Go through frames and fix the range so that it holds the values at all of them": (
        "Einzelbilder durchlaufen und den Bereich so festlegen, dass er die Werte aller enthält"
    ),
    "Sinew measures frames": "Sinew misst Einzelbilder",
    "{text} against {method}": "{text} gegen {method}",
    # Numbers
    "Numbers": "Zahlen",
    "Stretch, RMS": "Dehnung, RMS",
    "Distance, RMS": "Abstand, RMS",
    "At Rest": "In Ruhe",
    "Shown": "Gezeigt",
    "Least stretch": "Kleinste Dehnung",
    "Most stretch": "Größte Dehnung",
    "Collapse": "Einfallen",
    "at most {value}": "höchstens {value}",
    "Sinew deforms nothing here now": "Sinew verformt hier zurzeit nichts",
    # Worst frames
    "worst at {frame}": "am schlechtesten bei {frame}",
    "{measure} over {count} frames: {result}": "{measure} über {count} Einzelbilder: {result}",
    "Worst Frames": "Schlechteste Einzelbilder",
    "Find Worst Frames": "Schlechteste Einzelbilder suchen",
    "Find Worst Frames over the Scene's Frames": "Schlechteste Einzelbilder der Szene suchen",
    "Find Worst Frames over the Action's Frames": "Schlechteste Einzelbilder der Aktion suchen",
    "Go through frames and list those at which the measure is worst, one for each peak": (
        "Einzelbilder durchlaufen und die mit dem schlechtesten Maß auflisten, eines je Spitze"
    ),
    "Find": "Suchen",
    "{measure}, {methods}, {count} frames": "{measure}, {methods}, {count} Einzelbilder",
    "Frame {frame}:  {value}": "Einzelbild {frame}:  {value}",
    "{value} RMS": "{value} RMS",
    "{value} of the area": "{value} des Inhalts",
    "Nothing at any frame": "Nichts in allen Einzelbildern",
    "nothing at any frame": "nichts in allen Einzelbildern",
    "Go to Frame": "Gehe zu Einzelbild",
    "Go to this frame": "Zu diesem Einzelbild gehen",
    "Frame": "Einzelbild",
    "Of the scene": "Der Szene",
    # Diagnostics
    "Diagnostics": "Diagnostik",
    "Most Influences": "Höchstens Einflüsse",
    "How many bones may move a vertex before it is reported": (
        "Wie viele Knochen einen Punkt bewegen dürfen, bevor er gemeldet wird"
    ),
    "Check": "Prüfen",
    "Look for faults in the weights, and for what dual quaternions do in the pose of now": (
        "Nach Fehlern in den Gewichtungen suchen und danach, was duale Quaternionen in der jetzigen Pose tun"
    ),
    "Check over Frames": "Über Einzelbilder prüfen",
    "Look for faults in the weights, and for what dual quaternions do in the poses of all frames": (
        "Nach Fehlern in den Gewichtungen suchen und danach, was duale Quaternionen in den Posen aller "
        "Einzelbilder tun"
    ),
    "Over Frames": "Über Einzelbilder",
    "Check Weights and Pose": "Gewichtungen und Pose prüfen",
    "Check over the Scene's Frames": "Über die Einzelbilder der Szene prüfen",
    "Check over the Action's Frames": "Über die Einzelbilder der Aktion prüfen",
    "Sinew checks poses": "Sinew prüft Posen",
    "{count} kinds of faults": "{count} Arten von Fehlern",
    "Checked: weights, {poses}": "Geprüft: Gewichtungen, {poses}",
    "pose of frame {frame}": "Pose von Einzelbild {frame}",
    "poses of frames {first} to {last}": "Posen der Einzelbilder {first} bis {last}",
    "Nothing found": "Nichts gefunden",
    "Nothing found: {names}": "Nichts gefunden: {names}",
    "Select": "Auswählen",
    "Enter edit mode with exactly these vertices selected; hidden ones are shown": (
        "In den Bearbeitungsmodus gehen, mit genau diesen Punkten ausgewählt; verborgene werden gezeigt"
    ),
    "Select {count} Vertex": "{count} Punkt auswählen",
    "Select {count} Vertices": "{count} Punkte auswählen",
    "Selected {count} vertex": "{count} Punkt ausgewählt",
    "Selected {count} vertices": "{count} Punkte ausgewählt",
    "{name} is not in this scene any more; press Check again": (
        "{name} ist nicht mehr in dieser Szene; drücke noch einmal Prüfen"
    ),
    "Weights, groups or bones have changed since: press Check again": (
        "Gewichtungen, Gruppen oder Knochen haben sich seither geändert: Drücke noch einmal Prüfen"
    ),
    "What {names} in front makes of the mesh is not checked: it has no vertices to select": (
        "Was {names} davor aus der Masche macht, wird nicht geprüft: Es hat keine Punkte zum Auswählen"
    ),
    "More than {count} influences": "Mehr als {count} Einflüsse",
    "Use Weights > Limit Total with a limit of {count}, then Normalize All.": (
        "Nutze Gewichtungen > Totale Grenze mit der Grenze {count}, dann Alles normalisieren."
    ),
    "Vertices without weights": "Punkte ohne Gewichtungen",
    "Assign them to a bone's group, or parent the mesh again with automatic weights for them.": (
        "Weise sie der Gruppe eines Knochens zu, oder gib ihnen automatische Gewichtungen."
    ),
    "Weights that sum to almost nothing": "Gewichtungen, deren Summe fast null ist",
    "Paint them properly, or use Weights > Normalize All in weight paint mode.": (
        "Male sie richtig, oder nutze im Modus zum Malen der Gewichtungen Gewichtungen > Alles normalisieren."
    ),
    "Groups without a bone": "Gruppen ohne Knochen",
    "Rename the group to its bone's name, or delete it.": (
        "Benenne die Gruppe wie ihren Knochen, oder lösche sie."
    ),
    "Dual quaternions depend on the order of groups": (
        "Duale Quaternionen hängen von der Reihenfolge der Gruppen ab"
    ),
    "Take the bone with the largest rotation off these vertices, or spread the rotation over more bones.": (
        "Nimm den Knochen mit der größten Drehung von diesen Punkten, oder verteile die Drehung auf mehr "
        "Knochen."
    ),
    "Close to 180 degrees between bones": "Nahe 180 Grad zwischen Knochen",
    "Spread the rotation over twist bones, or keep these poses away from 180 degrees.": (
        "Verteile die Drehung auf Hilfsknochen, oder halte diese Posen von 180 Grad fern."
    ),
    "Dual quaternions change hemisphere in the action": (
        "Duale Quaternionen wechseln in der Aktion die Halbkugel"
    ),
    "Spread the rotation over twist bones, keep it below 180 degrees, or use linear blend here.": (
        "Verteile die Drehung auf Hilfsknochen, halte sie unter 180 Grad, oder nimm hier die Methode Linear."
    ),
    # Mending
    "Mend": "Beheben",
    "Mend this fault, on exactly these vertices, and check again. Locked groups stay as they are": (
        "Diesen Fehler an genau diesen Punkten beheben und noch einmal prüfen. Gesperrte Gruppen "
        "bleiben, wie sie sind"
    ),
    "{what}; then check again. Locked groups stay as they are": (
        "{what}; dann noch einmal prüfen. Gesperrte Gruppen bleiben, wie sie sind"
    ),
    "Mended {what}. Checked again: {count} left": "Behoben: {what}. Noch einmal geprüft: {count} übrig",
    "{done}; {count} could not be": "{done}; bei {count} ging es nicht",
    "{count} vertex": "{count} Punkt",
    "{count} vertices": "{count} Punkte",
    "{count} group": "{count} Gruppe",
    "{count} groups": "{count} Gruppen",
    "Limit Total": "Anzahl begrenzen",
    "Keep the largest weights of these vertices, and scale them to a sum of 1": (
        "Die größten Gewichtungen dieser Punkte behalten und auf die Summe 1 skalieren"
    ),
    "Normalize": "Normalisieren",
    "Scale the weights of these vertices to a sum of 1": (
        "Die Gewichtungen dieser Punkte auf die Summe 1 skalieren"
    ),
    "Smooth": "Glätten",
    "Bring the weights of these vertices closer to those of their neighbours": (
        "Die Gewichtungen dieser Punkte denen ihrer Nachbarn annähern"
    ),
    "From Neighbours": "Von Nachbarn",
    "Give these vertices the weights of those around them, from the border in": (
        "Diesen Punkten die Gewichtungen der umliegenden geben, vom Rand nach innen"
    ),
    "From Other Side": "Von der anderen Seite",
    "Give these vertices the weights of those at the mirrored place (X), in the groups of the other side": (
        "Diesen Punkten die Gewichtungen derer am gespiegelten Platz (X) geben, in den Gruppen der "
        "anderen Seite"
    ),
    "Remove Groups": "Gruppen entfernen",
    "Delete these vertex groups; those that are locked stay": "Diese Punktgruppen löschen; gesperrte bleiben",
}
