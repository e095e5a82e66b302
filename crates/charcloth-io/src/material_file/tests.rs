use super::*;

fn message(text: &str) -> String {
    load_text("paper.toml", text).unwrap_err().render(false)
}

#[test]
fn built_in_materials_are_read_and_close() {
    for row in MATERIALS {
        let material = load_text(row.name, row.item).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(material.name, row.name);
        assert_eq!(material.about, row.about);
    }
}

#[test]
fn the_folder_has_the_materials_of_the_table() {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../materials"));
    let mut files: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .filter_map(|entry| entry.unwrap().file_name().to_str()?.strip_suffix(".toml").map(str::to_owned))
        .collect();
    files.sort();
    let mut names: Vec<_> = MATERIALS.iter().map(|row| row.name.to_owned()).collect();
    names.sort();
    assert_eq!(files, names);
}

#[test]
fn a_number_without_source_is_pointed_at() {
    let text = "based_on = \"copy_paper_80\"\nname = \"mine\"\n[sheet]\ngrammage = \"90 g/m2\"\n";
    let error = message(text);
    assert!(error.contains("paper.toml:4:12") && error.contains("needs its source"), "{error}");
    assert!(error.contains("try:") && error.contains("tuned"), "{error}");
    let error = message(&text.replace("\"90 g/m2\"", "{ value = \"90 g/m2\" }"));
    assert!(error.contains("paper.toml:4") && error.contains("needs its source"), "{error}");
}

#[test]
fn mistakes_say_where_and_what_to_try() {
    let start = "based_on = \"copy_paper_80\"\nname = \"mine\"\n";
    for (text, place, words) in [
        ("[sheet]\ngramage = 1\n", ":4:1", "did you mean `grammage`"),
        ("[sheet]\ngrammage = { value = \"90 g\", source = \"X\" }\n", ":4:22", "a mass per area"),
        ("[sheet]\ngrammage = { value = \"90 g/m2\", tuned = \"a\" }\n", ":4:12", "range = [low, high]"),
        ("[sheet]\ngrammage = { value = 9, tuned = \"a\", range = [1, 2] }\n", ":4:12", "not within its range"),
        (
            "[sheet]\ngrammage = { value = 1, source = \"X\", range = [1, 2] }\n",
            ":4:12",
            "either from a source or tuned",
        ),
        ("[sheet]\ngrammage = { value = 1, sauce = \"X\" }\n", ":4:25", "did you mean `source`"),
        ("[sheet]\ngrammage = { value = -1, source = \"X\" }\n", ":4:1", "is not over 0"),
        ("[composition]\nfibre = { value = 0.5, source = \"X\" }\n", ":3:2", "add up to"),
    ] {
        let error = message(&format!("{start}{text}"));
        assert!(error.contains(&format!("paper.toml{place}")) && error.contains(words), "{text}\n{error}");
    }
    let error = message("based_on = \"copy_paper_90\"\n");
    assert!(error.contains(":1:12") && error.contains("copy_paper_80"), "{error}");
    let error = message("name = \"mine\"\nabout = \"\"\n");
    assert!(error.contains("`sheet` is missing"), "{error}");
    assert!(open("newsprint").unwrap_err().render(false).contains("newsprint_45"));
}
